/// A whole first pass in virtual time: cells on nodes, the controller, the network between them, the oracle watching.
#pragma once

#include <memory>
#include <vector>

#include "core/cell/cell.hpp"
#include "core/cluster/controller.hpp"
#include "sim/oracle.hpp"
#include "sim/simulation.hpp"

namespace lichthof::sim {

struct RadiosityRunOptions {
  SimulationOptions simulation;
  CellOptions cell;
  double eps = 5e-4;
  std::uint32_t nodes = 0;  ///< 0: one per cell; cells are dealt out in turn; the controller has a node of its own
  bool with_oracle = true;
};

class RadiosityRun {
 public:
  /// @param lights  one per cell of the grid
  RadiosityRun(std::shared_ptr<const CellGrid> grid, std::vector<std::unique_ptr<LightOfCell>> lights,
               const RadiosityRunOptions& options);
  RadiosityRun(const RadiosityRun&) = delete;
  RadiosityRun& operator=(const RadiosityRun&) = delete;

  /// Until nothing is left to happen. A run that ends without the controller being finished hangs: that is a bug.
  SimulationReport run() { return simulation_.run(); }
  /// A client's scene change, or an interruption, at the present moment of virtual time.
  void change(const GeometryChange& change);
  void stop(Stop how);
  void refresh_progress();

  Simulation& simulation() { return simulation_; }
  const Controller& controller() const { return controller_; }
  const Oracle& oracle() const { return oracle_; }
  const Cell& cell(std::uint32_t index) const { return *cells_[index]; }
  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(cells_.size()); }
  /// Sum over the cells.
  SolveCounters counters() const;

 private:
  std::vector<std::unique_ptr<Cell>> cells_;
  Controller controller_;
  Oracle oracle_;
  Simulation simulation_;
};

}  // namespace lichthof::sim
