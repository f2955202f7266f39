// Cells and controller as actors, with toy light, on a scheduler that runs only when told to.
#include "actors/cell_actor.hpp"

#include <doctest/doctest.h>

#include <stdexcept>

#include "actors/company.hpp"
#include "actors/controller_actor.hpp"
#include "tests/actors/test_system.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

/// Light that fails when a shot arrives from another cell.
class FailingLight final : public LightOfCell {
 public:
  explicit FailingLight(std::unique_ptr<LightOfCell> light) : light_(std::move(light)) {}
  CellLight::Candidate strongest() const override { return light_->strongest(); }
  double largest_initial_power() const override { return light_->largest_initial_power(); }
  Shot take_shot(GroupId group, ShotId id, SceneVersion version) override {
    return light_->take_shot(group, id, version);
  }
  TransferWork receive(const Shot& shot, const HemicubeBitmap* incoming) override {
    if (incoming) throw std::runtime_error("out of light");
    return light_->receive(shot, incoming);
  }
  std::vector<Passage> project(const Shot& shot, std::span<const NextCell> next,
                                      const HemicubeBitmap& bitmap) const override {
    return light_->project(shot, next, bitmap);
  }
  void set_emission(std::uint32_t, const Rgb&) override {}
  void set_reflectance(std::uint32_t, const Rgb&) override {}
  CellPower power() const override { return light_->power(); }

 private:
  std::unique_ptr<LightOfCell> light_;
};

/// A first pass on the test scheduler.
struct Run : test::TestSystem {
  test::ToyWorld world;
  std::vector<std::shared_ptr<Cell>> cells;
  std::shared_ptr<Controller> controller;
  actors::RunContext context;
  std::vector<actors::CellControl> handles;
  actors::ControllerActor lead;
  actors::Company company{system};

  Run(const CellPosition& size, double eps, std::uint32_t failing = ~0u)
      : Run(test::toy_world(size, 4, 3), eps, failing) {}
  Run(test::ToyWorld world_, double eps, std::uint32_t failing = ~0u) : world(std::move(world_)) {
    context.board = std::make_shared<actors::Board>(world.grid->cell_count());
    context.meters = std::make_shared<actors::Meters>();
    CellOptions options;
    options.hemicube_resolution = 8;
    std::vector<std::unique_ptr<LightOfCell>> lights = test::toy_lights(world);
    for (CellId id{0}; id.value < lights.size(); ++id.value) {
      auto light = std::move(lights[id.value]);
      if (id.value == failing) light = std::make_unique<FailingLight>(std::move(light));
      cells.push_back(std::make_shared<Cell>(id, world.grid, std::move(light), options));
      handles.push_back(system.spawn<caf::lazy_init>(actors::cell_actor, cells.back(), context));
    }
    ControllerOptions lead_options;
    lead_options.cells = world.grid->cell_count();
    lead_options.eps = eps;
    controller = std::make_shared<Controller>(lead_options);
    lead = system.spawn<caf::lazy_init>(actors::controller_actor, controller, handles, context);
    self->monitor(lead);
  }
  ~Run() {
    for (const auto& cell : handles) actors::kill_now(cell);
    actors::kill_now(lead);
    scheduler.run();
  }
  void begin() { self->send(lead, actors::begin_atom_v); }

  std::vector<Rgb> radiosity() const {
    std::vector<Rgb> all;
    for (const auto& cell : cells)
      for (const test::ToyPatch& patch : dynamic_cast<const test::ToyLight&>(cell->light()).patches())
        all.push_back(patch.emission + patch.reflectance * patch.irradiance);
    return all;
  }
};

double largest_difference(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  double scale = 0, worst = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    scale = std::max(scale, glm::length(b[k]));
    worst = std::max(worst, glm::length(a[k] - b[k]));
  }
  return worst / scale;
}

}  // namespace

TEST_SUITE("cell actor") {
  TEST_CASE("cell actor: four cells converge to the light of one cell, and the controller quits") {
    Run four({2, 2, 1}, 1e-5), one(test::undivided(four.world), 1e-5);
    for (Run* run : {&four, &one}) {
      run->begin();
      run->scheduler.run();
      CHECK(run->controller->converged());
      CHECK(!run->reason_of_end());
      for (const auto& cell : run->cells) CHECK(!cell->running());
    }
    // Each may leave eps of unshot power per patch: 16 patches, reflected a few times.
    CHECK(largest_difference(four.radiosity(), one.radiosity()) < 16 * 10 * 1e-5);
    CHECK(four.context.board->progress().phase == RunPhase::finished);
    CHECK(four.context.board->progress().shots == four.controller->progress().shots);
    CHECK(four.context.board->progress().cells_idle == 4);
  }

  TEST_CASE("cell actor: nothing happens before the controller has introduced the cells") {
    Run run({2, 2, 1}, 1e-3);
    run.scheduler.run();
    CHECK(run.controller->phase() == RunPhase::gathering);
    CHECK(run.controller->progress().cells_ready == 0);
  }

  TEST_CASE("cell actor: looking at the board changes no step") {
    Run calm({2, 2, 1}, 1e-4), watched({2, 2, 1}, 1e-4);
    calm.begin();
    calm.scheduler.run();
    watched.begin();
    std::uint64_t shots = 0;
    while (watched.scheduler.try_run_once()) {
      watched.context.board->ask();
      const RadiosityProgress progress = watched.context.board->progress();
      CHECK(progress.shots >= shots);
      shots = progress.shots;
    }
    CHECK(watched.controller->converged());
    CHECK(calm.radiosity() == watched.radiosity());
  }

  TEST_CASE("cell actor: a stopped run lets shots under way arrive") {
    Run run({3, 2, 1}, 1e-6);
    run.begin();
    for (int k = 0; k < 40; ++k) run.scheduler.try_run_once();
    REQUIRE(run.controller->phase() == RunPhase::radiosity);
    run.self->send(run.lead, Stop::after_pending);
    run.scheduler.run();
    CHECK(run.controller->finished());
    CHECK(!run.controller->converged());
    CHECK(!run.reason_of_end());
    std::uint64_t sent = 0, processed = 0;
    for (const auto& cell : run.cells) sent += cell->state().sent, processed += cell->state().processed;
    CHECK(sent == processed);
  }

  TEST_CASE("cell actor: a scene change goes through the controller to every cell") {
    Run run({2, 2, 1}, 1e-3);
    run.begin();
    for (int k = 0; k < 20; ++k) run.scheduler.try_run_once();
    run.self->send(run.lead, GeometryChange{{}, SetEmission{1, Rgb{3.0}}});
    run.scheduler.run();
    CHECK(run.controller->converged());
    for (const auto& cell : run.cells) CHECK(cell->version() == SceneVersion{1});
  }

  TEST_CASE("cell actor: a cell that fails ends the run with its reason") {
    Run run({2, 2, 1}, 1e-4, 2);
    run.begin();
    run.scheduler.run();
    CHECK(!run.controller->finished());
    CHECK(actors::text(run.reason_of_end()) == "cell 2: out of light");
  }

  TEST_CASE("cell actor: a message that nobody foresaw does no harm") {
    Run run({2, 1, 1}, 1e-3);
    run.begin();
    caf::anon_send(caf::actor_cast<caf::actor>(run.handles[0]), std::string("hello"));
    caf::anon_send(caf::actor_cast<caf::actor>(run.lead), 5, 6);
    run.scheduler.run();
    CHECK(run.controller->converged());
  }

  TEST_CASE("cell actor: light from a stranger is refused, and what runs goes on") {
    Run run({2, 1, 1}, 1e-3);
    run.begin();
    Shot shot{};
    run.self->send(run.handles[1], HemicubeMessage{std::make_shared<const Shot>(shot), CellId{9}, false, {1, 2, 3}});
    run.scheduler.run();
    CHECK(run.cells[1]->state().refused == 1);
    CHECK(run.controller->progress().shots > 0);
  }

  TEST_CASE("cell actor: its meter shows what it did") {
    Run run({2, 2, 1}, 1e-4);
    run.begin();
    run.scheduler.run();
    const auto meters = run.context.meters->all();
    REQUIRE(meters.size() == 5);
    std::uint64_t steps = 0;
    for (const auto& meter : meters) {
      CAPTURE(meter->name);
      CHECK(meter->runs > 0);
      CHECK(meter->busy_ns > 0);
      CHECK(meter->arrived >= meter->steps);
      if (meter->name != "controller") steps += meter->steps;
    }
    CHECK(steps >= run.context.board->progress().shots);
  }
}
