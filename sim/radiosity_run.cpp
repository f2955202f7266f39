#include "sim/radiosity_run.hpp"

#include "core/base/check.hpp"

namespace lichthof::sim {

namespace {
std::vector<std::unique_ptr<Cell>> cells_of(const std::shared_ptr<const CellGrid>& grid,
                                            std::vector<std::unique_ptr<LightOfCell>> lights,
                                            const CellOptions& options) {
  MUST(lights.size() == grid->cell_count());
  std::vector<std::unique_ptr<Cell>> cells;
  for (std::uint32_t k = 0; k < lights.size(); ++k)
    cells.push_back(std::make_unique<Cell>(CellId{k}, grid, std::move(lights[k]), options));
  return cells;
}

std::vector<const Cell*> views_of(const std::vector<std::unique_ptr<Cell>>& cells) {
  std::vector<const Cell*> views;
  for (const auto& cell : cells) views.push_back(cell.get());
  return views;
}
}  // namespace

RadiosityRun::RadiosityRun(std::shared_ptr<const CellGrid> grid, std::vector<std::unique_ptr<LightOfCell>> lights,
                           const RadiosityRunOptions& options)
    : cells_(cells_of(grid, std::move(lights), options.cell)),
      controller_(ControllerOptions{grid->cell_count(), options.eps, options.cell.epoch}),
      oracle_(grid, views_of(cells_), controller_), simulation_(options.simulation) {
  const std::uint32_t nodes = options.nodes == 0 ? cell_count() : options.nodes;
  simulation_.add(ToController{}, NodeId{nodes}, controller_);
  for (std::uint32_t k = 0; k < cell_count(); ++k) simulation_.add(CellId{k}, NodeId{k % nodes}, *cells_[k]);
  if (options.with_oracle)
    simulation_.set_observer([this](const Observation& observation) { oracle_.observe(observation); });
}

void RadiosityRun::change(const GeometryChange& change) {
  simulation_.post({ToController{}, ToController{}, change}, simulation_.now());
}

void RadiosityRun::stop(Stop how) {
  controller_.stop(how);
  simulation_.nudge(ToController{});
}

void RadiosityRun::refresh_progress() {
  controller_.refresh_progress();
  simulation_.nudge(ToController{});
}

SolveCounters RadiosityRun::counters() const {
  SolveCounters sum;
  for (const auto& cell : cells_) sum += cell->counters();
  return sum;
}

}  // namespace lichthof::sim
