/// A lab in memory that answers like a cluster: two nodes, some jobs that only change when a test says so.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "actors/link/digest.hpp"
#include "apps/cluster/lab_service.hpp"

namespace lichthof::testing {

class ToyLab final : public apps::LabService {
 public:
  nlohmann::json nodes() override {
    const std::lock_guard lock(mutex_);
    nlohmann::json all = nlohmann::json::array();
    for (const char* name : {"lab1", "lab2"})
      all.push_back({{"id", all.size() + 1},
                     {"name", name},
                     {"host", "10.0.0." + std::to_string(all.size() + 1)},
                     {"state", drained.count(name) ? "draining" : "busy"},
                     {"cores", 4},
                     {"rays_per_s", 1.25e6},
                     {"memory_bytes", 8e9},
                     {"free_memory_bytes", 5e9},
                     {"busy_share", 0.5},
                     {"bytes_in", 1000},
                     {"bytes_out", 2000},
                     {"jobs", {1}},
                     {"seen_s", 0.2}});
    return all;
  }
  nlohmann::json actors() override {
    nlohmann::json all = {
        {{"node", "lab1"}, {"actor", "cell 0"}, {"kind", "cell"}, {"job", 1}, {"busy_share", 0.9}},
        {{"node", "lab2"}, {"actor", "worker 1"}, {"kind", "worker"}, {"job", 1}, {"busy_share", 0.1}}};
    all[0]["actor"] = "cell 0" + std::string(padding, '.');
    return all;
  }
  nlohmann::json jobs(std::size_t = SIZE_MAX) override {
    const std::lock_guard lock(mutex_);
    nlohmann::json all = nlohmann::json::array();
    for (const auto& [id, job] : jobs_) all.push_back(job);
    return all;
  }
  Expected<nlohmann::json> job(std::uint64_t id) override {
    ++looks;
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    return jobs_[id];
  }
  bool has_scene(const std::string& hash) override {
    const std::lock_guard lock(mutex_);
    return scenes.count(hash) > 0;
  }
  Expected<std::string> add_scene(const std::string& bytes) override {
    const std::lock_guard lock(mutex_);
    if (bytes == "damaged") return Error{ErrorCode::bad_input, "scene", "is damaged"};
    const std::string hash = lichthof::actors::sha256_of(bytes);
    scenes[hash] = bytes;
    ++uploads;
    return hash;
  }
  Expected<std::uint64_t> submit(const nlohmann::json& spec, const apps::Caller& caller) override {
    const std::lock_guard lock(mutex_);
    if (!scenes.count(spec["scene"])) return Error{ErrorCode::bad_input, "scene", "is not known here"};
    const std::uint64_t id = jobs_.size() + 1;
    last_spec = spec;
    jobs_[id] = {{"id", id},
                 {"title", spec.value("title", "")},
                 {"state", start_state},
                 {"pass", "rays"},
                 {"progress", 0.5},
                 {"seconds", 3.0},
                 {"owner", caller.name}};
    return id;
  }
  Status cancel(std::uint64_t id) override { return move(id, "cancelled"); }
  Status resume(std::uint64_t id) override {
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    if (jobs_[id]["state"] == "done") return Error{ErrorCode::failed, "", "job is done: nothing is left to resume"};
    jobs_[id]["state"] = "running";
    return Done{};
  }
  Status drain(const std::string& node, bool on) override {
    const std::lock_guard lock(mutex_);
    if (node != "lab1" && node != "lab2") return Error{ErrorCode::bad_input, "", "there is no node " + node};
    on ? (void)drained.insert(node) : (void)drained.erase(node);
    return Done{};
  }
  Status kick(const std::string& node) override { return drain(node, true); }
  Expected<std::string> result(std::uint64_t id, const std::string& kind) override {
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    if (jobs_[id]["state"] != "done") return Error{ErrorCode::failed, "", "the job is not done"};
    return kind + std::string(result_padding, '!');
  }
  Expected<std::string> log(std::uint64_t id) override {
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    return std::string("it began\nit went \x1b[31mon\n");
  }
  nlohmann::json methods() override { return {{{"name", "two-pass"}, {"text", "both passes"}}}; }
  std::string metrics() override { return "# TYPE lichthof_nodes gauge\nlichthof_nodes 2\n"; }
  Expected<std::string> picture_so_far(std::uint64_t id) override {
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    return std::string("\x89PNG");
  }

  std::atomic<int> looks{0};  ///< at single jobs

  /// A job in a state.
  std::uint64_t add_job(const std::string& state) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t id = jobs_.size() + 1;
    jobs_[id] = {{"id", id},         {"title", "a room"}, {"state", state},
                 {"progress", 0.25}, {"seconds", 61},     {"reason", ""}};
    return id;
  }
  Status move(std::uint64_t id, const std::string& state, const std::string& reason = "") {
    const std::lock_guard lock(mutex_);
    if (!jobs_.count(id)) return none();
    jobs_[id]["state"] = state, jobs_[id]["reason"] = reason;
    return Done{};
  }
  std::string state(std::uint64_t id) {
    const std::lock_guard lock(mutex_);
    return jobs_.count(id) ? jobs_[id]["state"].get<std::string>() : "";
  }

  // Looked at and set while nobody asks.
  std::map<std::string, std::string> scenes;
  std::set<std::string> drained;
  nlohmann::json last_spec;
  std::string start_state = "done";
  std::size_t result_padding = 0;
  int uploads = 0;

  std::atomic<std::size_t> padding{0};  ///< bytes that make the state of the lab long; also while somebody asks

 private:
  static Error none() { return {ErrorCode::bad_input, "", "there is no such job"}; }

  std::mutex mutex_;
  std::map<std::uint64_t, nlohmann::json> jobs_;
};

}  // namespace lichthof::testing
