/// The lead's actor: what it knows of nodes and jobs, all of it on one thread. What concerns nodes, their links and what they are
/// handed stands in lead_nodes.cpp; jobs, the dispatcher's orders and the passes under way in lead_jobs.cpp.
#pragma once

#include <caf/all.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "actors/cluster/kept_columns.hpp"
#include "actors/cluster/kept_light.hpp"
#include "actors/cluster/lead.hpp"
#include "actors/cluster/lead_file.hpp"
#include "actors/cluster/run_lead.hpp"
#include "actors/drive.hpp"

namespace lichthof::actors {

/// Of the day, kept in files (s since 1970).
inline double unix_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

class LeadState {
 public:
  static constexpr const char* name = "lead";

  // lead.cpp
  void begin(caf::event_based_actor* self, LeadOptions options, std::shared_ptr<BlobCache> blobs, Dispatcher dispatcher,
             std::map<JobId, KeptJob> kept);
  void use(const Link& link);
  void end();
  void on_tick();
  LabView view(std::optional<JobId> only);

  // lead_nodes.cpp
  void on(const LinkUp& up);
  void on(const LinkDown& down);
  void on(const FrameArrived& frame);
  Status drain(const std::string& node_name, bool is_draining);
  Status kick(const std::string& node_name);

  // lead_jobs.cpp
  Expected<JobId> submit(const JobOrder& order);
  Status cancel(JobId job);
  Status retry(JobId job);
  void fetched(JobId id);
  Expected<Image> picture(JobId id);
  void on(KeptLight& light);

 private:
  struct KnownNode {
    std::string name, version;
    PeerId link;
    Peer peer;
    NodeReport report, before;  ///< the last two
  };
  struct Job {
    KeptJob kept;
    std::unique_ptr<RunLead> run;
    std::uint64_t written = 0;           ///< sequence of the light kept last
    std::string begun_with;              ///< blob that the epoch under way began with
    std::uint32_t writings = 0;          ///< threads that write its light
    std::optional<KeptColumns> columns;  ///< of its picture, while that is traced
    std::uint64_t bytes = 0;             ///< of its results on disk, once it has ended
    EnergyLedger energy;
    SolveCounters counters;
  };
  /// Of a node about another one.
  struct Complaint {
    NodeId node;
    HostFailed failed;
    Instant due;
  };

  // lead_nodes.cpp
  void admit(PeerId peer, const Registration& facts);
  template <class Other>
  void on(NodeId, Other&) {}  // of the other direction
  void on(NodeId node, NodeReport& report);
  void on(NodeId node, Leaving& leaving);
  void on(NodeId node, Hosted& hosted);
  void on(NodeId node, HostFailed& failed);
  void on(NodeId node, WantBlob& want);
  void on(NodeId node, RunMessage& message);
  void on(NodeId node, CellImage& image);
  void hear_complaints();
  Status for_named(const std::string& wanted, const std::function<Status(NodeId)>& act);
  void carry_out(const DropNode& order);
  void carry_out(const NodeDrained& order);
  void forget(NodeId node);
  void to_node(NodeId node, const ClusterMessage& message, bool is_bulk = false);

  // lead_jobs.cpp
  Status decided(Status status);
  void step() { (void)decide(); }
  /// The dispatcher decides; what it decided is written down, then carried out. @error io: nothing was carried out
  Status decide();
  Status keep();
  void carry_out(const HostRun& order);
  void carry_out(const BeginPass& order);
  void carry_out(const ReleaseRun& order);
  void carry_out(const TakeCheckpoint& order);
  void carry_out(const JobEnded& order);
  RunLead* run_at(JobId id, Epoch epoch);
  /// What the dispatcher has booked for a node's share.
  std::uint64_t booked(JobId job, NodeId node) const;
  void look_at(RunLead& run);
  void take_up_columns(JobId id, Job& job);
  void keep_columns(JobId id, Job& job);
  std::string columns_path(JobId job) const { return options_.folder + "/columns/" + std::to_string(job.value); }
  void drop_stale();
  /// Forgets jobs that ended long ago, and what lies on disk for them. @returns whether the lab is full of what has to stay
  bool forget_old();
  std::uint64_t bytes_on_disk(JobId id, const Job& job) const;
  std::string result_path(JobId id) const { return options_.folder + "/results/" + std::to_string(id.value) + ".exr"; }
  void say(JobId job, const std::string& line);
  template <class Pairs>
  std::string names(const Pairs& pairs) {
    std::string text;
    for (const auto& [node, what] : pairs) text += (text.empty() ? "" : ", ") + nodes_[node].name;
    return text;
  }

  caf::event_based_actor* self_ = nullptr;
  LeadOptions options_;
  std::shared_ptr<BlobCache> blobs_;
  std::optional<Link> link_;
  Clock clock_;
  Instant refreshed_, forgot_;
  Dispatcher dispatcher_;
  std::uint32_t last_node_ = 0;
  std::uint64_t last_writing_ = 0;
  std::set<std::string> stale_;
  std::deque<Complaint> complaints_;
  std::map<PeerId, LinkUp> strangers_;
  std::map<PeerId, NodeId> node_of_;
  std::map<NodeId, KnownNode> nodes_;
  std::map<JobId, Job> jobs_;
};

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::KeptLight)
