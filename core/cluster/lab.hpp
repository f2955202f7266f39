/// What a lab is made of: nodes, jobs, the orders its dispatcher gives and the journal that outlives the controller.
///
/// Driver's contract. The records of a step are written before its orders are carried out, and before a submission is
/// acknowledged. Orders to one node arrive in their order. A node that loses its controller (its link breaks, or it is
/// dropped) releases everything before it joins again; nothing of an old link arrives after the new one's join.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/ids.hpp"
#include "core/base/types.hpp"
#include "core/cluster/pace.hpp"

namespace lichthof {

struct NodeFacts {
  std::string name;
  std::uint32_t cores = 1;
  std::uint64_t memory_bytes = 0;
  double rays_per_s = 0;  ///< of one core; 0: not measured, counts as the slowest that is
};

/// running: hosted somewhere, or being hosted. queued: waits for its turn, or for nodes after it lost some.
enum class JobState : std::uint8_t { queued, running, done, failed, cancelled };
inline const char* name_of(JobState state) {
  constexpr const char* names[] = {"queued", "running", "done", "failed", "cancelled"};
  return names[static_cast<std::size_t>(state)];
}
inline bool has_ended(JobState state) { return state != JobState::queued && state != JobState::running; }
enum class Pass : std::uint8_t { radiosity, picture };

struct JobWish {
  std::string title;
  bool radiosity = true, picture = true;
  std::array<std::uint32_t, 3> grid{1, 1, 1};
  std::vector<std::uint32_t> patches;  ///< per cell of the grid, x fastest
  std::uint64_t bytes_per_patch = 2000;
  std::uint64_t base_bytes = 0;  ///< on every node that takes part; a ray worker needs it and all patches
  std::int32_t priority = 0;     ///< higher ones first
  bool operator==(const JobWish&) const = default;
};
/// @error a grid without cells or patches for other cells, no pass, more bytes than any machine has
Status plausible(const JobWish& wish);

// ---- Orders -----------------------------------------------------------------------------------------------------------

/// Host this and say `hosted`. A second one of the same epoch (picture only) names one more node: its workers start as soon
/// as they are there and the pass has begun.
struct HostRun {
  JobId job;
  Epoch epoch;
  Pass pass = Pass::radiosity;
  bool from_checkpoint = false;                               ///< radiosity: resume from the last kept checkpoint
  std::vector<std::pair<NodeId, std::vector<CellId>>> cells;  ///< pass radiosity
  std::vector<std::pair<NodeId, std::uint32_t>> workers;      ///< pass picture: threads per node
};
/// Everybody awaited has said `hosted`.
struct BeginPass {
  JobId job;
  Epoch epoch;
  Pass pass = Pass::radiosity;
};
/// Release whatever is left of it.
struct ReleaseRun {
  JobId job;
  Epoch epoch;
  std::optional<NodeId> node;  ///< there alone (a draining node's ray workers); absent: everywhere
};
struct TakeCheckpoint {
  JobId job;
  Epoch epoch;
};
struct JobEnded {
  JobId job;
  JobState state = JobState::done;
  std::string reason;
};
/// Break the link: the node is not counted on any more.
struct DropNode {
  NodeId node;
  std::string reason;
};
/// Nothing is left on a draining node.
struct NodeDrained {
  NodeId node;
};
using Order = std::variant<HostRun, BeginPass, ReleaseRun, TakeCheckpoint, JobEnded, DropNode, NodeDrained>;

// ---- Journal ----------------------------------------------------------------------------------------------------------

namespace journal {
struct Submitted {
  JobId job;
  JobWish wish;
};
/// Written before the epoch is used, so that none is used twice.
struct EpochBegun {
  JobId job;
  Epoch epoch;
};
struct CheckpointKept {
  JobId job;
};
struct NodeLost {
  JobId job;
  std::string name;
};
struct PassFinished {
  JobId job;
  Pass pass = Pass::radiosity;
};
struct Ended {
  JobId job;
  JobState state = JobState::done;
  std::string reason;
};
struct Retried {
  JobId job;
};
/// It had ended long ago; its number is not given again.
struct Forgotten {
  JobId job;
};
/// The last number given, where jobs that had it are forgotten.
struct Numbered {
  JobId job;
};
/// Of a node, by its name: it holds when the node joins anew.
struct Draining {
  std::string node;
  bool is_draining = true;
};
}  // namespace journal
using JournalEntry = std::variant<journal::Submitted, journal::EpochBegun, journal::CheckpointKept, journal::NodeLost,
                                  journal::PassFinished, journal::Ended, journal::Retried, journal::Forgotten,
                                  journal::Numbered, journal::Draining>;

// ---- What is known ----------------------------------------------------------------------------------------------------

struct LabNode {
  NodeFacts facts;
  Instant heard;                    ///< last sign of life
  std::uint64_t foreign_bytes = 0;  ///< taken by other programs, by its last report
  Pace pace;
  bool draining = false, drained = false;
};

/// The share of one node in a run.
struct Share {
  std::uint64_t bytes = 0;  ///< booked for it
  bool hosted = false;      ///< it said so
  bool awaited = true;      ///< the pass does not begin before it has
  Instant due;              ///< when it must have said so
};

/// A pass of a job that is hosted, or being hosted.
struct HostedPass {
  Epoch epoch;
  Pass pass = Pass::radiosity;
  bool begun = false;
  std::vector<NodeId> nodes_of_cells;  ///< pass radiosity
  std::map<NodeId, Share> shares;
  /// Nodes whose workers were sent away alone. What they said before may still be under way, so none return this epoch.
  std::set<NodeId> sent_away;
  std::optional<Instant> checkpoint_at;   ///< absent: one is under way, or none is due in this pass
  std::optional<Instant> checkpoint_due;  ///< when the one under way must have been answered
  bool may_move = false;                  ///< a checkpoint has just been kept
  Instant hosted_at;                      ///< when the order was given
  std::optional<Instant> begin_at;        ///< picture: when it begins with the nodes that are there
};

struct LabJob {
  JobWish wish;
  JobState state = JobState::queued;
  Pass pass = Pass::radiosity;  ///< at hand, or next
  Epoch epoch;                  ///< the last one used
  bool has_checkpoint = false;
  std::string reason;  ///< why it waits, or why it ended as it did
  std::optional<HostedPass> run;
  std::vector<std::string> lost_nodes;     ///< while they hosted it; of those lost together the first
  std::optional<Instant> lost_at;          ///< the last of these
  std::map<NodeId, std::string> unsuited;  ///< nodes that could not host it, and why
  std::optional<Instant> hopeless_since;   ///< the whole lab could not hold it
  std::uint32_t stuck = 0;                 ///< checkpoints in a row that nobody answered
  std::uint32_t moves = 0;                 ///< of its cells, for speed
};

}  // namespace lichthof
