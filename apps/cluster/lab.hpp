/// The real lab behind the desk: turns what people ask for into orders for the lead, and what the lead knows into documents.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "actors/cluster/lead.hpp"
#include "apps/cluster/figures.hpp"
#include "apps/cluster/lab_service.hpp"

namespace lichthof::apps {

struct LabOptions {
  actors::LeadOptions lead;                 ///< its files and logs are set by open()
  unsigned threads = 1;                     ///< for meshing what is submitted
  std::string version;                      ///< of the program, for figures
  std::uint64_t scene_bytes = 16ull << 30;  ///< of scenes handed in; those used longest ago go
};

class Lab final : public LabService {
 public:
  /// @error as actors::Lead::start()
  static Expected<std::unique_ptr<Lab>> open(LabOptions options);

  std::uint16_t port() const { return lead_->port(); }
  /// Brings the counters of metrics() up to date: to be called about once a second.
  void count() { figures_.look(nodes(), jobs()); }

  nlohmann::json nodes() override;
  nlohmann::json actors() override;
  nlohmann::json jobs(std::size_t most_ended = SIZE_MAX) override;
  Expected<nlohmann::json> job(std::uint64_t id) override;
  bool has_scene(const std::string& hash) override;
  Expected<std::string> add_scene(const std::string& bytes) override;
  Expected<std::uint64_t> submit(const nlohmann::json& spec, const Caller& caller) override;
  Status cancel(std::uint64_t job) override;
  Status resume(std::uint64_t job) override;
  Status drain(const std::string& node, bool on) override;
  Status kick(const std::string& node) override;
  Expected<std::string> result(std::uint64_t job, const std::string& kind) override;
  Expected<std::string> log(std::uint64_t job) override;
  nlohmann::json methods() override;
  std::string metrics() override;
  Expected<std::string> picture_so_far(std::uint64_t job) override;

 private:
  explicit Lab(LabOptions options) : options_(std::move(options)), figures_(options_.version) {}
  /// A view that is at most so fresh as a screen needs.
  actors::LabView view();
  Expected<actors::JobView> job_view(std::uint64_t id);
  Expected<std::string> result_of(const actors::JobView& job, const std::string& kind);
  void trim_scenes(const std::string& keep);
  std::string scene_path(const std::string& hash) const;
  std::string log_path(JobId job) const;
  std::string png_path(JobId job) const;

  LabOptions options_;
  std::unique_ptr<actors::Lead> lead_;

  std::mutex mutex_;
  actors::LabView view_;
  std::chrono::steady_clock::time_point viewed_;

  struct Picture {
    std::string png;
    std::chrono::steady_clock::time_point made, next;  ///< not made anew before `next`
  };
  std::mutex pictures_mutex_;
  std::map<JobId, Picture> pictures_;  ///< of jobs under way
  LabFigures figures_;
};

}  // namespace lichthof::apps
