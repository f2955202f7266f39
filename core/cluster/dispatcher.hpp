/// The machine that leads a lab: which job runs when and where, what happens when nodes come, go, fall silent or drain,
/// and what of it survives a restart of the controller. It knows nothing of light.
///
///     queued ──HostRun, fresh epoch──► hosting ──all hosted──► begun ──pass_finished──► queued for its picture, or done
///       ▲                                 │                      │
///       └────────ReleaseRun───────────────┴──node lost, moved────┘        failed, cancelled: from anywhere; retry ► queued
///
/// - Order: priority, then submission. A job that waits for memory other jobs hold is not overtaken; one that waits for
///   the lab itself (too small, drained, foreign programs in its memory) lets others pass.
/// - Radiosity loses a node: all is released and hosted anew from the last checkpoint under a new epoch. The picture loses
///   one: the balancer gives its columns to others; only without any worker left it is hosted anew.
/// - Nothing is waited for without end: a share that is not hosted, a checkpoint that is not answered have their leases.
/// - A node that has become slow (core/cluster/pace) is left at the next checkpoint, which is asked for at once.
/// - The calls file what happened and release what is lost; `step` decides and gives the orders. A call about an epoch that
///   is not the job's present one is ignored: nothing counts twice.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/cluster/lab.hpp"
#include "core/cluster/placement.hpp"

namespace lichthof {

struct DispatcherOptions {
  Duration lease{10'000'000'000};            ///< a node silent for as long is lost
  Duration checkpoint_every{5'000'000'000};  ///< while radiosity runs
  Duration patience{60'000'000'000};         ///< a job that the whole lab could not hold for as long fails
  /// A node that has not hosted its share after as long, nor fetched more of what it needs, is not suited for the job.
  Duration hosting_lease{300'000'000'000};
  /// A job whose checkpoint is not answered for as long is placed anew,
  Duration checkpoint_lease{120'000'000'000};
  std::uint32_t most_stuck = 3;              ///< and fails after as many in a row
  Duration gathering{2'000'000'000};         ///< a picture begins so long after its first node is ready, whoever is late
  Duration settling{10'000'000'000};         ///< cells that moved for speed stay as long, then twice as long each time
  PaceOptions pace;
  std::uint32_t most_node_kills = 3;         ///< a job that loses as many nodes fails
  Duration lost_together{3'000'000'000};     ///< nodes lost within as long count once: they were cut off
  std::uint32_t most_running_jobs = 8;
  std::uint32_t most_waiting_jobs = 1000;  ///< beyond, submissions are refused
  Placement heuristic = Placement::neighbours;
};

struct Dispatched {
  std::vector<Order> orders;          ///< in this order
  std::vector<JournalEntry> records;  ///< to be written before
  std::optional<Instant> wake_at;     ///< step no later than this
};

class Dispatcher {
 public:
  explicit Dispatcher(const DispatcherOptions& options = {}) : options_(options) {}
  /// After a restart of the controller: nobody has joined yet, jobs that ran wait for nodes.
  /// @error a journal that no dispatcher wrote
  static Expected<Dispatcher> restored(const DispatcherOptions& options, std::span<const JournalEntry> journal);
  /// The shortest journal that restores the same jobs.
  std::vector<JournalEntry> summary() const;

  // Nodes. What a stranger reports is ignored: it has been dropped and will join again.
  void node_joined(NodeId node, const NodeFacts& facts, Instant now);
  void node_reported(NodeId node, std::uint64_t free_memory_bytes, Instant now);
  /// @param share  of a core that its actors got while they had work; @see core/cluster/pace
  void node_paced(NodeId node, double share, Instant now);
  void node_left(NodeId node, const std::string& reason, Instant now);
  /// It goes by itself (its owner is back, it is being stopped): its jobs do not count it as a node they killed.
  void node_parted(NodeId node, const std::string& reason, Instant now);
  /// From now on no new work; what is there moves on, cells at the next checkpoint. NodeDrained says when nothing is left.
  /// It holds for the node's name: also after a restart of the controller, and when the node joins anew.
  /// @error no such node
  Status drain(NodeId node, bool is_draining, Instant now);
  /// The same by name, so that a node which is away can be taken back. @error no such node, and none was drained
  Status drain(const std::string& node, bool is_draining);
  /// Drops the node; its jobs do not count it as a node they killed. @error no such node
  Status kick(NodeId node, Instant now);

  // Jobs.
  /// @error bad_input: a wish that can not be: a grid without cells or patches for other cells, no pass, too many bytes;
  ///        failed: too many jobs wait
  Expected<JobId> submit(const JobWish& wish, Instant now);
  /// @error no such job, or it has ended
  Status cancel(JobId job, Instant now);
  /// A failed or cancelled job goes on from its last checkpoint. @error no such job, or neither of the two
  Status retry(JobId job, Instant now);
  /// Nothing is known of the job any more. @error no such job, or it has not ended
  Status forget(JobId job);

  // Runs.
  void hosted(NodeId node, JobId job, Epoch epoch, Instant now);
  /// It is still fetching what it needs for its share.
  void still_hosting(NodeId node, JobId job, Epoch epoch, Instant now);
  /// The node can not host its share (out of memory): it is not asked again for this job while it stays.
  void host_failed(NodeId node, JobId job, Epoch epoch, const std::string& reason, Instant now);
  /// Light of its cells is coming in, or being written.
  void still_keeping(JobId job, Epoch epoch, Instant now);
  void checkpoint_kept(JobId job, Epoch epoch, Instant now);
  /// The next one is asked for in its turn.
  void checkpoint_failed(JobId job, Epoch epoch, Instant now);
  void pass_finished(JobId job, Epoch epoch, Instant now);
  void pass_failed(JobId job, Epoch epoch, const std::string& reason, Instant now);

  bool has_work(Instant now) const;
  /// Decides. Calling it more often than needed does no harm.
  Dispatched step(Instant now);

  const std::map<NodeId, LabNode>& nodes() const { return nodes_; }
  const std::map<JobId, LabJob>& jobs() const { return jobs_; }
  /// Names of nodes that get no new work.
  const std::set<std::string>& draining() const { return draining_; }
  /// What runs have booked on a node.
  std::uint64_t booked_bytes(NodeId node) const;
  const DispatcherOptions& options() const { return options_; }

 private:
  /// Whose memory a placement may count on.
  enum class Room : std::uint8_t {
    now,         ///< what is free
    others_end,  ///< as if no other job ran
    empty_lab,   ///< as if nothing ran, draining nodes included
  };
  /// A place for the pass at hand: nodes of cells, or workers.
  struct Place {
    std::vector<NodeId> nodes_of_cells;
    std::vector<std::pair<NodeId, std::uint32_t>> workers;
  };

  // dispatcher.cpp
  LabJob* job_at(JobId job, Epoch epoch);
  void lose(NodeId node, const std::string& reason, bool counts, Instant now);
  void lose_share(JobId id, LabJob& job, NodeId node, const std::string& reason, bool counts, Instant now);
  void release(JobId id, LabJob& job);
  void requeue(JobId id, LabJob& job, const std::string& reason);
  void end(JobId id, LabJob& job, JobState state, const std::string& reason);
  void expire_leases(Instant now);
  void expire_orders(Instant now);

  // dispatcher_plan.cpp
  void plan(Instant now);
  bool start(JobId id, LabJob& job, Instant now);
  void host(JobId id, LabJob& job, Place place, Instant now);
  void begin(JobId id, LabJob& job, Instant now);
  void ask_for_checkpoint(JobId id, LabJob& job, Instant now);
  void move_cells(JobId id, LabJob& job, Instant now);
  void move_workers(JobId id, LabJob& job, bool is_memory_wanted, Instant now);
  void look_for_drained();
  void wait_for_the_lab(JobId id, LabJob& job, const Error& shortage, Instant now);
  Expected<Place> place(const LabJob& job, Room room) const;
  std::vector<Seat> seats(const LabJob& job, Room room) const;
  std::optional<Instant> next_wake() const;

  // dispatcher_journal.cpp
  Status replay(const JournalEntry& entry);

  DispatcherOptions options_;
  std::map<NodeId, LabNode> nodes_;
  std::map<JobId, LabJob> jobs_;
  std::set<std::string> draining_;  ///< names of nodes
  std::uint64_t last_job_ = 0;
  bool is_changed_ = true;              ///< something happened that a plan may depend on
  std::optional<Instant> promised_at_;  ///< the wake_at given last
  Dispatched due_;
};

}  // namespace lichthof
