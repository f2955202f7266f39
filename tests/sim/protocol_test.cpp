// The whole first pass in virtual time with toy light: a thousand orders of delivery, one result.
#include <doctest/doctest.h>

#include <map>

#include "sim/radiosity_run.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

sim::RadiosityRunOptions options_with(std::uint64_t seed) {
  sim::RadiosityRunOptions options;
  options.simulation.seed = seed;
  // Delays of the order of a step and far beyond: every interleaving of neighbours comes up.
  options.simulation.network.jitter = Duration{seed % 3 == 0 ? 20'000 : 2'000'000};
  options.simulation.max_events = 200'000;
  options.cell.hemicube_resolution = 8;
  options.eps = 3e-3;
  return options;
}

const test::ToyLight& toy(const Cell& cell) { return static_cast<const test::ToyLight&>(cell.light()); }

/// Largest difference between what the patches received and what all shots, whoever shot them when, must have given them.
double linear_defect(const sim::RadiosityRun& run) {
  double worst = 0;
  for (std::uint32_t r = 0; r < run.cell_count(); ++r)
    for (const test::ToyPatch& receiver : toy(run.cell(r)).patches()) {
      Rgb expected{0.0};
      for (std::uint32_t s = 0; s < run.cell_count(); ++s)
        for (const test::ToyPatch& shooter : toy(run.cell(s)).patches())
          expected += test::disc_form_factor(receiver, shooter.centre, shooter.normal, shooter.area) * shooter.shot;
      worst = std::max(worst, glm::length(expected - receiver.irradiance) / (1e-12 + glm::length(expected) + 1e-3));
    }
  return worst;
}

/// Radiosity B of every patch, cell by cell.
std::vector<Rgb> radiosity_of(const sim::RadiosityRun& run) {
  std::vector<Rgb> all;
  for (std::uint32_t c = 0; c < run.cell_count(); ++c)
    for (const test::ToyPatch& patch : toy(run.cell(c)).patches())
      all.push_back(patch.emission + patch.reflectance * patch.irradiance);
  return all;
}

double largest_difference(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  double scale = 0, worst = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    scale = std::max(scale, glm::length(b[k]));
    worst = std::max(worst, glm::length(a[k] - b[k]));
  }
  return worst / scale;
}

}  // namespace

TEST_SUITE("simulation") {
  TEST_CASE("simulation: 1000 orders of delivery: joins never hang, termination is never early, energy is kept") {
    std::uint64_t joins = 0;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
      const CellPosition sizes[] = {{3, 2, 1}, {2, 2, 2}, {4, 1, 1}, {3, 3, 1}, {1, 1, 1}};
      const test::ToyWorld world = test::toy_world(sizes[seed % 5], 3, seed / 5);
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(seed));
      const sim::SimulationReport report = run.run();
      CAPTURE(seed);
      REQUIRE(run.oracle().broken() == "");
      REQUIRE(!report.exhausted);
      REQUIRE(run.controller().converged());
      REQUIRE(run.oracle().open_shots() == 0);
      REQUIRE(run.controller().progress().shots == run.oracle().shots());
      REQUIRE(linear_defect(run) < 1e-6);
      joins += run.oracle().joins();
    }
    CHECK(joins > 10'000);  // the thousand runs did meet what they are about
  }

  TEST_CASE("simulation: a free run of many cells ends within eps of the one-cell radiosity") {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const test::ToyWorld world = test::toy_world({3, 2, 1}, 4, seed);
      const test::ToyWorld one = test::undivided(world);
      sim::RadiosityRunOptions options = options_with(seed);
      options.eps = 1e-5;
      sim::RadiosityRun many_run(world.grid, test::toy_lights(world), options),
          one_run(one.grid, test::toy_lights(one), options);
      many_run.run();
      one_run.run();
      CAPTURE(seed);
      REQUIRE(many_run.oracle().broken() == "");
      REQUIRE(many_run.controller().converged());
      REQUIRE(one_run.controller().converged());
      // Each of the two may leave eps of unshot power per patch: 24 patches, reflected a few times.
      CHECK(largest_difference(radiosity_of(many_run), radiosity_of(one_run)) < 24 * 10 * 1e-5);
      CHECK(one_run.counters().messages == 0);
      CHECK(one_run.counters().bitmap_bytes == 0);
    }
  }

  TEST_CASE("simulation: the same seed gives the same run, bit for bit") {
    const test::ToyWorld world = test::toy_world({3, 3, 1}, 3, 5);
    sim::RadiosityRun first(world.grid, test::toy_lights(world), options_with(11)),
        second(world.grid, test::toy_lights(world), options_with(11));
    const sim::SimulationReport a = first.run(), b = second.run();
    CHECK(a.end == b.end);
    CHECK(a.events == b.events);
    CHECK(a.bytes == b.bytes);
    CHECK(radiosity_of(first) == radiosity_of(second));
  }

  TEST_CASE("simulation: cells that share nodes give the same light as cells with a node each") {
    const test::ToyWorld world = test::toy_world({3, 2, 1}, 4, 3);
    sim::RadiosityRunOptions options = options_with(2);
    options.eps = 1e-5;
    options.nodes = 2;
    sim::RadiosityRun shared(world.grid, test::toy_lights(world), options);
    options.nodes = 0;
    sim::RadiosityRun apart(world.grid, test::toy_lights(world), options);
    shared.run();
    apart.run();
    CHECK(shared.oracle().broken() == "");
    CHECK(largest_difference(radiosity_of(shared), radiosity_of(apart)) < 24 * 10 * 1e-5);
  }

  TEST_CASE("simulation: a thousand cells converge, and their bitmaps meet in twos") {
    const test::ToyWorld world = test::toy_world({40, 25, 1}, 1, 1);
    sim::RadiosityRunOptions options = options_with(1);
    options.eps = 0.5;
    options.with_oracle = false;
    options.simulation.max_events = 3'000'000;
    sim::RadiosityRun run(world.grid, test::toy_lights(world), options);
    const sim::SimulationReport report = run.run();
    CHECK(!report.exhausted);
    CHECK(run.controller().converged());
    CHECK(run.counters().shots > 200);
    CHECK(linear_defect(run) < 1e-6);
  }
}

TEST_SUITE("simulation: changes and interruption") {
  TEST_CASE("§2.1: emission and reflectance may change at any event; the end is the radiosity of the changed scene") {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      test::ToyWorld world = test::toy_world({3, 2, 1}, 3, seed);
      sim::RadiosityRunOptions options = options_with(seed);
      options.eps = 1e-5;
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options);
      const GeometryChange lamp{{}, SetEmission{2, Rgb{1, 2, 3}}}, paint{{}, SetReflectance{1, Rgb{0.1, 0.7, 0.0}}};
      for (std::uint64_t k = 0; k < 37 * seed && run.simulation().run_one(); ++k) {
      }
      run.change(lamp);
      for (std::uint64_t k = 0; k < 11 * seed && run.simulation().run_one(); ++k) {
      }
      run.change(paint);
      run.run();
      CAPTURE(seed);
      REQUIRE(run.oracle().broken() == "");
      REQUIRE(run.controller().converged());
      CHECK(run.controller().version() == SceneVersion{2});
      CHECK(linear_defect(run) < 1e-6);

      // The scene as it is after the changes, solved from the start.
      for (auto& patches : world.patches)
        for (test::ToyPatch& patch : patches) {
          if (patch.material == 2) patch.emission = std::numbers::pi * Rgb{1, 2, 3};
          if (patch.material == 1) patch.reflectance = Rgb{0.1, 0.7, 0.0};
        }
      sim::RadiosityRun fresh(world.grid, test::toy_lights(world), options);
      fresh.run();
      CHECK(largest_difference(radiosity_of(run), radiosity_of(fresh)) < 18 * 10 * 1e-5);
    }
  }

  TEST_CASE("simulation: an interrupted run lets shots under way arrive, so that no energy is lost") {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const test::ToyWorld world = test::toy_world({3, 2, 1}, 3, seed);
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(seed));
      for (std::uint64_t k = 0; k < 5 * seed && run.simulation().run_one(); ++k) {
      }
      const bool was_finished = run.controller().finished();
      run.stop(Stop::after_pending);
      run.run();
      CAPTURE(seed);
      REQUIRE(run.oracle().broken() == "");
      REQUIRE(run.controller().finished());
      CHECK(run.controller().converged() == was_finished);
      CHECK(run.oracle().open_shots() == 0);
      CHECK(run.oracle().on_the_wire() == 0);
      CHECK(linear_defect(run) < 1e-6);
    }
  }

  TEST_CASE("simulation: stopped at once, every machine comes to rest though messages were on the wire") {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const test::ToyWorld world = test::toy_world({3, 2, 1}, 3, seed);
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(seed));
      for (std::uint64_t k = 0; k < 7 * seed && run.simulation().run_one(); ++k) {
      }
      run.stop(Stop::after_pending);
      run.stop(Stop::at_once);
      run.run();
      CAPTURE(seed);
      CHECK(run.oracle().broken() == "");
      CHECK(run.controller().finished());
      for (std::uint32_t c = 0; c < run.cell_count(); ++c) CHECK(!run.cell(c).running());
    }
  }

  TEST_CASE("simulation: progress numbers grow while the run is under way") {
    const test::ToyWorld world = test::toy_world({3, 3, 1}, 3, 8);
    sim::RadiosityRunOptions options = options_with(8);
    options.eps = 1e-4;
    sim::RadiosityRun run(world.grid, test::toy_lights(world), options);
    std::uint64_t shots = 0;
    for (int look = 0; look < 5; ++look) {
      for (int k = 0; k < 300; ++k) run.simulation().run_one();
      run.refresh_progress();
      for (int k = 0; k < 100; ++k) run.simulation().run_one();
      const RadiosityProgress progress = run.controller().progress();
      CHECK(progress.shots >= shots);
      shots = progress.shots;
      CHECK(progress.threshold_w == doctest::Approx(1e-4 * progress.largest_initial_power_w));
    }
    CHECK(shots > 0);
  }
}
