// What §5 reports of the radiosity pass: how it ends, and how its speed-up bends.
#include <doctest/doctest.h>

#include <algorithm>

#include "sim/radiosity_run.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

/// A building of 12 x 12 rooms without furniture: opaque walls with a gap for a door, a lamp in some of the rooms.
test::ToyWorld building() {
  constexpr std::uint32_t side = 12;
  test::ToyWorld world = test::toy_world({side, side, 1}, 6, 21);
  Random random(5);
  for (CellId cell{0}; cell.value < side * side; ++cell.value) {
    for (test::ToyPatch& patch : world.patches[cell.value])
      if (patch.material == 9 && random.below(3)) patch.emission = Rgb{0.0};
    const Box box = world.grid->box(cell);
    const double x = box.lo.x + 0.999, y = box.lo.y + 0.999;
    world.walls[cell.value] = {{{x, y - 0.999, 0}, {x, y - 0.4, 0}, {x, y - 0.4, 1}, {x, y - 0.999, 1}},
                               {{x - 0.999, y, 0}, {x - 0.4, y, 0}, {x - 0.4, y, 1}, {x - 0.999, y, 1}}};
  }
  return world;
}

/// The same patches and walls in fewer cells.
test::ToyWorld divided(const test::ToyWorld& whole, std::uint32_t along_x, std::uint32_t along_y) {
  std::array<std::vector<double>, 3> boundaries;
  for (std::uint32_t k = 1; k < along_x; ++k) boundaries[0].push_back(12.0 * k / along_x);
  for (std::uint32_t k = 1; k < along_y; ++k) boundaries[1].push_back(12.0 * k / along_y);
  test::ToyWorld world;
  world.grid = std::make_shared<const CellGrid>(whole.grid->bounds(), boundaries);
  world.patches.resize(world.grid->cell_count());
  world.walls.resize(world.grid->cell_count());
  for (CellId room{0}; room.value < whole.grid->cell_count(); ++room.value) {
    const CellId cell = world.grid->cell_of(whole.grid->box(room).centre());
    for (const auto& patch : whole.patches[room.value]) world.patches[cell.value].push_back(patch);
    for (const auto& wall : whole.walls[room.value]) world.walls[cell.value].push_back(wall);
  }
  return world;
}

sim::RadiosityRunOptions options() {
  sim::RadiosityRunOptions options;
  options.eps = 0.02;
  options.cell.hemicube_resolution = 32;
  options.simulation.max_events = 3'000'000;
  options.simulation.cost.ray_ns = 2'000;  // the paper's machine, not ours: 133 MHz
  options.with_oracle = false;
  return options;
}

}  // namespace

TEST_SUITE("paper §5") {
  TEST_CASE("§5: the run ends when no shot is above eps of the strongest light, and none is under way") {
    const test::ToyWorld world = test::toy_world({3, 3, 1}, 3, 2);
    for (const double eps : {1e-1, 1e-2, 1e-3}) {
      sim::RadiosityRunOptions with_eps;
      with_eps.eps = eps;
      with_eps.cell.hemicube_resolution = 8;
      sim::RadiosityRun run(world.grid, test::toy_lights(world), with_eps);
      run.run();
      REQUIRE(run.controller().converged());
      CHECK(run.oracle().broken() == "");
      double strongest_light = 0, strongest_left = 0;
      for (std::uint32_t c = 0; c < run.cell_count(); ++c) {
        strongest_light = std::max(strongest_light, run.cell(c).light().largest_initial_power());
        strongest_left = std::max(strongest_left, run.cell(c).light().strongest().power_w);
      }
      CHECK(strongest_left <= eps * strongest_light);
      CHECK(run.oracle().open_shots() == 0);
      CHECK(run.oracle().on_the_wire() == 0);
    }
  }

  TEST_CASE("§5 Tab. 1: the speed-up grows up to 36 cells while the efficiency falls") {
    const test::ToyWorld whole = building();
    // Visits to covered cells are spared, so a few cells can be a little more than that many times as fast as one.
    double one_cell_s = 0, last_speed_up = 0, last_efficiency = 1.3;
    for (const auto& [x, y] : {std::pair{1u, 1u}, {2u, 2u}, {4u, 3u}, {6u, 6u}}) {
      const test::ToyWorld world = divided(whole, x, y);
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options());
      const sim::SimulationReport report = run.run();
      REQUIRE(run.controller().converged());
      const double seconds = 1e-9 * static_cast<double>(report.end.ns);
      if (x * y == 1) one_cell_s = seconds;
      const double speed_up = one_cell_s / seconds, efficiency = speed_up / (x * y);
      INFO((x * y) << " cells: speed-up " << speed_up << ", efficiency " << efficiency);
      CHECK(speed_up > last_speed_up);
      CHECK(efficiency < last_efficiency);
      last_speed_up = speed_up;
      if (x * y > 1) last_efficiency = efficiency;
    }
  }

  TEST_CASE("§5: cells in dark regions are idle first") {
    // Light in the left half of the building only.
    test::ToyWorld whole = building();
    for (CellId room{0}; room.value < whole.grid->cell_count(); ++room.value)
      if (whole.grid->position(room)[0] >= 6)
        for (test::ToyPatch& patch : whole.patches[room.value]) patch.emission = Rgb{0.0};
    const test::ToyWorld world = divided(whole, 4, 3);
    sim::RadiosityRun run(world.grid, test::toy_lights(world), options());
    const sim::SimulationReport report = run.run();
    double bright = 0, dark = 0;
    for (std::uint32_t c = 0; c < run.cell_count(); ++c)
      (world.grid->position(CellId{c})[0] < 2 ? bright : dark) +=
          static_cast<double>(report.nodes.at(NodeId{c}).busy.ns);
    CHECK(dark < 0.7 * bright);
  }
}
