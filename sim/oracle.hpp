/// Watches a simulated first pass from outside and knows what must never happen. It shares no code with the protocol but
/// the geometry of the visible zone.
///
/// After every event it checks
///   - the invariants of the cell that moved (core/cell/cell_invariants),
///   - messages: sent by all cells = received by all + on the wire,
///   - every shot reaches every cell of its visible zone at most once, and none before all that cell's predecessors,
///   - energy: what a cell has received is what the transfers into it reported,
/// and at the end of the run: every shot has reached its whole zone, nothing is on the wire, nobody is above the threshold.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/cell/cell.hpp"
#include "core/cluster/controller.hpp"
#include "sim/simulation.hpp"

namespace lichthof::sim {

class Oracle {
 public:
  Oracle(std::shared_ptr<const CellGrid> grid, std::vector<const Cell*> cells, const Controller& controller);

  void observe(const Observation& observation);

  /// The first thing that went wrong, with the virtual time; empty while all is well.
  const std::string& broken() const { return broken_; }

  std::uint64_t shots() const { return shots_; }
  std::uint64_t joins() const { return joins_; }
  std::uint64_t most_joined() const { return most_joined_; }
  std::uint64_t visits_skipped() const { return skipped_; }
  /// Shots that have not yet been through all cells of their zone.
  std::size_t open_shots() const { return open_.size(); }
  /// Hemicube messages on the wire.
  std::uint64_t on_the_wire() const { return on_the_wire_; }

 private:
  struct OpenShot {
    ShooterPose pose;
    std::size_t zone = 0;
    std::set<CellId> visited;
  };
  void observe_cell(const Cell& cell, const Observation& observation);
  void observe_events(const Cell& cell, const Effects& effects);
  void observe_visit(ShotId shot, CellId cell);
  void check_end();
  void fail(const std::string& what);

  std::shared_ptr<const CellGrid> grid_;
  std::vector<const Cell*> cells_;
  const Controller& controller_;
  std::map<ShotId, OpenShot> open_;
  std::vector<double> reported_received_w_;  ///< per cell, from the events of its transfers
  std::uint64_t sent_ = 0, received_ = 0, on_the_wire_ = 0;
  std::uint64_t shots_ = 0, joins_ = 0, most_joined_ = 0, skipped_ = 0;
  Instant now_;
  std::string broken_;
};

}  // namespace lichthof::sim
