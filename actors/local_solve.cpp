// The first pass inside this process; see local_run.hpp.
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <stdexcept>

#include "actors/company.hpp"
#include "actors/controller_actor.hpp"
#include "actors/local_run.hpp"
#include "actors/system_config.hpp"
#include "core/base/check.hpp"
#include "core/light/balance.hpp"
#include "core/light/expected_light.hpp"
#include "core/light/one_cell.hpp"
#include "core/tracing/mirror_light.hpp"

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr auto look_every = 50ms;  // at the stop flag
constexpr auto show_every = 200ms;
constexpr auto patience = 2s;  // for shots under way when a run is stopped

using Lights = std::vector<std::shared_ptr<CellLight>>;

Lights lights_of(const SolveRun& run, const Solution* begun, const std::shared_ptr<const GroupExchange>& exchange) {
  TransferOptions options;
  options.method = run.options.method;
  options.hemicube_resolution = run.options.hemicube_resolution;
  const std::vector<std::vector<GroupId>> groups = groups_by_cell(*run.mesh, *run.grid);
  const bool is_divided = run.grid->cell_count() > 1;
  Lights lights;
  for (CellId cell{0}; cell.value < run.grid->cell_count(); ++cell.value) {
    // A cell that is alone has no boundary to clip to.
    const Box box = is_divided ? run.grid->box(cell) : Box{Vec3{-1e300}, Vec3{1e300}};
    lights.push_back(std::make_shared<CellLight>(run.scene, run.mesh, groups[cell.value], box, options, run.parallel,
                                                 exchange));
    if (begun) lights.back()->load(*begun);
  }
  return lights;
}

std::vector<std::shared_ptr<Cell>> cells_of(const SolveRun& run, const Lights& lights) {
  CellOptions options;
  options.hemicube_resolution = run.options.hemicube_resolution;
  std::vector<std::shared_ptr<Cell>> cells;
  for (std::uint32_t k = 0; k < lights.size(); ++k)
    cells.push_back(std::make_shared<Cell>(CellId{k}, run.grid, std::make_unique<RealLight>(lights[k]), options));
  return cells;
}

/// Waits for the end of a run and passes on what comes from outside meanwhile.
class Watch {
 public:
  Watch(const SolveRun& run, Board& board, caf::scoped_actor& self, const ControllerActor& controller)
      : run_(run), board_(board), self_(self), controller_(controller) {}

  /// @returns none, or why the run failed
  caf::error until_the_end() {
    self_->monitor(controller_);
    self_->send(controller_, begin_atom_v);
    caf::error reason;
    for (bool over = false; !over;) {
      self_->receive(
          [&](const caf::down_msg& down) {
            over = true;
            reason = down.reason;
          },
          caf::after(look_every) >> [] {});
      if (!over) look();
    }
    if (run_.progress && !reason) run_.progress(board_.progress());
    return reason;
  }

 private:
  void look() {
    const SteadyTime now = std::chrono::steady_clock::now();
    if (run_.stop && *run_.stop && !stopped_) {
      stopped_ = now;
      self_->send(controller_, Stop::after_pending);
    } else if (stopped_ && !hastened_ && now - *stopped_ > patience) {
      hastened_ = true;
      spdlog::warn("stopped before all light had arrived; the energy ledger shows what is lost");
      self_->send(controller_, Stop::at_once);
    }
    if (!run_.progress || now - shown_ < show_every) return;
    shown_ = now;
    run_.progress(board_.progress());
    board_.ask();
  }

  const SolveRun& run_;
  Board& board_;
  caf::scoped_actor& self_;
  const ControllerActor& controller_;
  std::optional<SteadyTime> stopped_;
  bool hastened_ = false;
  SteadyTime shown_ = std::chrono::steady_clock::now();
};

/// Drives the machines until the controller says that it is over. @post no actor is left
void play(const SolveRun& run, const std::vector<std::shared_ptr<Cell>>& cells,
          const std::shared_ptr<Controller>& controller) {
  SystemConfig config;
  caf::actor_system system(config);
  Company company(system);
  const RunContext context{Clock(), std::make_shared<Board>(run.grid->cell_count()), run.meters, nullptr, {}};
  context.board->ask();

  // Nobody runs before the first message: the order of the steps follows from the machines alone.
  std::vector<CellControl> handles;
  for (const auto& cell : cells)
    handles.push_back(company.join(system.spawn<caf::lazy_init>(cell_actor, cell, context)));
  const ControllerActor lead =
      company.join(system.spawn<caf::lazy_init>(controller_actor, controller, handles, context));

  caf::scoped_actor self{system};
  const caf::error failure = Watch(run, *context.board, self, lead).until_the_end();
  company.dismiss();
  if (failure) throw std::runtime_error("the first pass failed: " + text(failure));
}

}  // namespace

Solution solve(const SolveRun& run) {
  MUST(run.scene && run.mesh && run.grid && run.parallel);
  MUST(!run.resume || run.resume->irradiance.size() == run.mesh->elements.size());
  const SteadyTime start = std::chrono::steady_clock::now();
  const std::optional<Solution> by_mirrors =
      run.resume ? std::nullopt : light_by_mirrors(run.scene, run.mesh, run.options, *run.parallel);
  const Solution* const begun = run.resume ? run.resume : by_mirrors ? &*by_mirrors : nullptr;
  const auto exchange = std::make_shared<const GroupExchange>(*run.scene, *run.mesh, *run.parallel);
  Lights lights = lights_of(run, begun, exchange);
  std::vector<std::shared_ptr<Cell>> cells = cells_of(run, lights);
  ControllerOptions options;
  options.cells = run.grid->cell_count();
  options.eps = run.options.eps;
  const auto controller = std::make_shared<Controller>(options);
  play(run, cells, controller);

  Solution solution = blank_solution(run.scene, run.mesh);
  solution.options = run.options;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    lights[k]->store(solution);
    solution.counters += cells[k]->counters();
    const CellPower power = lights[k]->power();
    solution.energy.emitted += sum_channels(power.emitted);
    solution.energy.absorbed += sum_channels(power.absorbed);
    solution.energy.unshot += sum_channels(power.unshot);
  }
  set_pending(solution, *exchange);
  cells.clear(), lights.clear();  // what comes next needs room of its own
  if (begun) {
    solution.energy.mirrored = begun->energy.mirrored;
    solution.energy.mirrored_direct = begun->energy.mirrored_direct;
  }
  solution.energy.absorbed -= solution.energy.mirrored;
  solution.converged = controller->converged();
  balance(solution, *run.parallel);
  solution.seconds_radiosity = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return solution;
}

}  // namespace lichthof::actors
