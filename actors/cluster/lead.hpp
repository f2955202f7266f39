/// The controller's process as far as machines and nodes go: it keeps the dispatcher, leads the passes of running jobs, hands
/// out what nodes need, and writes down what must survive. Who serves people asks it through this handle, from any thread.
#pragma once

#include <caf/all.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "actors/cluster/blob_cache.hpp"
#include "actors/cluster/cluster_messages.hpp"
#include "actors/link/link.hpp"
#include "core/cluster/controller.hpp"
#include "core/cluster/dispatcher.hpp"
#include "core/cluster/retention.hpp"
#include "core/light/solution.hpp"
#include "core/tracing/image.hpp"

namespace lichthof::actors {

/// What a job needs besides the dispatcher's wish.
struct JobOrder {
  JobWish wish;
  std::string solution;  ///< blob to begin with: a scene's mesh without light, or light so far
  PictureSpec picture;
  double eps = 5e-4;
  std::string owner;
};

/// A job as people see it.
struct JobView {
  JobId id;
  JobOrder order;
  LabJob job;
  std::string solution;  ///< blob of the light so far: the last checkpoint, or the end
  RadiosityProgress radiosity;
  std::vector<CellReport> cells;  ///< the latest of each
  std::uint32_t columns_done = 0, columns = 0;
  std::uint64_t rays = 0;  ///< of the picture
  double seconds = 0;      ///< since it was submitted, until its end
  double ended_s = 0;      ///< since 1970; 0: it has not
  EnergyLedger energy;     ///< of the light so far
  SolveCounters counters;
};
struct NodeView {
  NodeId id;
  LabNode node;
  std::string host, version;
  NodeReport report, before;  ///< the last two
  std::uint64_t bytes_in = 0, bytes_out = 0;
  double seen_s = 0;  ///< since it was last heard
  std::vector<JobId> jobs;
};
struct LabView {
  std::vector<NodeView> nodes;
  std::vector<JobView> jobs;
};

struct LeadOptions {
  LinkOptions link;
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  std::string folder;  ///< state: journal, blobs, results
  DispatcherOptions dispatcher;
  RetentionOptions retention;
  unsigned threads = 1;  ///< for measuring what escapes
  std::function<Expected<Solution>(const std::string& path)> read_solution;
  std::function<Status(const std::string& path, const Solution&)> write_solution;
  std::function<Status(const std::string& path, const Image&)> write_picture;
  std::function<void(JobId, const std::string& line)> log;
  std::function<void(JobId)> forgotten;  ///< its log may go
};

class LeadState;

class Lead {
 public:
  /// @error bad_input, io: keys, address, folder, journal
  static Expected<std::unique_ptr<Lead>> start(LeadOptions options);
  ~Lead();

  std::uint16_t port() const { return port_; }
  BlobCache& blobs() { return *blobs_; }

  Expected<JobId> submit(const JobOrder& order);
  Status cancel(JobId job);
  Status retry(JobId job);
  /// Somebody has had the job's result: it may be forgotten.
  void fetched(JobId job);
  /// @param node  by name. @error no such node
  Status drain(const std::string& node, bool is_draining);
  Status kick(const std::string& node);
  /// @param only  of the jobs, this one alone
  LabView view(std::optional<JobId> only = std::nullopt);
  /// The picture of a job, black where columns are missing. @error none yet
  Expected<Image> picture(JobId job);

 private:
  Lead() = default;
  template <class Result>
  Result ask(std::function<Result(LeadState&)> question);

  std::uint16_t port_ = 0;
  std::shared_ptr<BlobCache> blobs_;
  std::unique_ptr<caf::actor_system_config> config_;
  std::unique_ptr<caf::actor_system> system_;
  caf::actor actor_;
  std::optional<Link> link_;
};

}  // namespace lichthof::actors
