/// Watches a lab in virtual time from outside: it alone sees what nodes really host, beside what the dispatcher believes.
///
/// Epochs only grow; no cell of a job is hosted twice in one epoch; no node hosts more than its memory; a pass that begins
/// has all its cells; cells do not move for speed again before they have settled; no order is waited for longer than its
/// lease; a job ends once; an accepted job is never lost; what is done was done.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/cluster/dispatcher.hpp"

namespace lichthof::sim {

/// A share of a run as a node really holds it.
struct ModelShare {
  Pass pass = Pass::radiosity;
  std::uint64_t bytes = 0;
  bool hosted = false, begun = false;
  std::map<CellId, double> rest;  ///< work left at `since`
  Instant since;

  double work() const {
    double sum = 0;
    for (const auto& [cell, left] : rest) sum += left;
    return sum;
  }
};

struct ModelNode {
  bool alive = false;
  std::uint64_t link = 0;  ///< the connection it believes in; 0: none
  std::map<std::pair<JobId, Epoch>, ModelShare> shares;

  std::uint64_t used_bytes() const {
    std::uint64_t sum = 0;
    for (const auto& [key, share] : shares) sum += share.bytes;
    return sum;
  }
};

class LabOracle {
 public:
  /// What is wrong, the first thing that was; empty: nothing.
  const std::string& broken() const { return broken_; }
  void complain(const std::string& what) {
    if (broken_.empty()) broken_ = what;
  }

  void accepted(JobId job) { jobs_[job]; }
  void retried(JobId job) { jobs_[job].ended = false; }
  void pass_was_done(JobId job, Pass pass) { jobs_[job].passes_done.insert(pass); }
  void ordered(const Order& order, const Dispatcher& dispatcher);
  /// @param holds  whether the node really hosts its share, or has broken its link since
  void began(const BeginPass& order, NodeId node, bool holds);
  /// After every event. @param node_of  the model of a node the dispatcher knows
  void look(const Dispatcher& dispatcher, bool controller_is_up, Instant now);
  /// A new dispatcher counts anew.
  void restarted();
  void look(NodeId id, const ModelNode& node, std::uint64_t memory_bytes);
  /// Between two looks at all nodes.
  void forget_cells() { seen_cells_.clear(); }

 private:
  struct Seen {
    Epoch epoch;
    bool ended = false;
    std::set<Pass> passes_done;
    std::set<NodeId> hosts;  ///< of the present epoch
    std::uint32_t moves = 0;
    std::optional<Instant> moved_at;
  };
  void hosting(const HostRun& order, const JobWish& wish);
  void look_at_waiting(JobId id, const LabJob& job, const DispatcherOptions& options, Instant now);

  std::map<JobId, Seen> jobs_;
  std::set<std::pair<std::pair<JobId, Epoch>, CellId>> seen_cells_;
  std::string broken_;
};

}  // namespace lichthof::sim
