// The first pass as a whole: cells iterating asynchronously, in virtual time, with exact toy light.
#include <doctest/doctest.h>

#include "sim/radiosity_run.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

sim::RadiosityRunOptions options_with(double eps, std::uint64_t seed) {
  sim::RadiosityRunOptions options;
  options.eps = eps;
  options.simulation.seed = seed;
  options.simulation.network.jitter = Duration{3'000'000};
  options.simulation.max_events = 1'000'000;
  options.cell.hemicube_resolution = 8;
  return options;
}

std::vector<Rgb> radiosity_of(const sim::RadiosityRun& run) {
  std::vector<Rgb> all;
  for (std::uint32_t c = 0; c < run.cell_count(); ++c)
    for (const test::ToyPatch& patch : static_cast<const test::ToyLight&>(run.cell(c).light()).patches())
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

/// Unshot power below eps may be left on each of the 24 patches of a run, and is reflected a few times.
constexpr double eps = 1e-6, left_over = 24 * 10 * eps;

}  // namespace

TEST_SUITE("paper §2") {
  TEST_CASE("§2: every interleaving of the cells' iterations ends at the same solution") {
    const test::ToyWorld world = test::toy_world({3, 2, 1}, 4, 12);
    sim::RadiosityRun reference(world.grid, test::toy_lights(world), options_with(eps, 1));
    reference.run();
    for (std::uint64_t seed = 2; seed <= 40; ++seed) {
      sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(eps, seed));
      const sim::SimulationReport report = run.run();
      CAPTURE(seed);
      CHECK(report.end != reference.simulation().report().end);  // it did run otherwise
      CHECK(run.oracle().broken() == "");
      CHECK(run.controller().converged());
      CHECK(largest_difference(radiosity_of(run), radiosity_of(reference)) < left_over);
    }
  }

  TEST_CASE("§2: many cells end at the solution of one cell") {
    const test::ToyWorld many = test::toy_world({2, 3, 2}, 2, 7), one = test::undivided(many);
    sim::RadiosityRun many_run(many.grid, test::toy_lights(many), options_with(eps, 3));
    sim::RadiosityRun one_run(one.grid, test::toy_lights(one), options_with(eps, 3));
    many_run.run();
    one_run.run();
    CHECK(many_run.oracle().broken() == "");
    CHECK(many_run.counters().messages > 0);
    CHECK(one_run.counters().messages == 0);
    CHECK(largest_difference(radiosity_of(many_run), radiosity_of(one_run)) < left_over);
  }

  TEST_CASE("§2: the solution so far can be read after every iteration") {
    const test::ToyWorld world = test::toy_world({2, 2, 1}, 3, 5);
    sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(1e-3, 1));
    std::uint64_t looks = 0;
    while (run.simulation().run_one()) {
      Rgb in{0.0}, out{0.0};
      for (std::uint32_t c = 0; c < run.cell_count(); ++c) {
        const CellPower power = run.cell(c).light().power();
        in += power.emitted + power.received;
        out += power.absorbed + power.shot + power.unshot;
      }
      REQUIRE(glm::length(in - out) <= 1e-6 * glm::length(in));  // whatever is on its way, the ledger balances
      ++looks;
    }
    CHECK(looks > 50);
  }

  TEST_CASE("§2: every iteration brings the solution nearer to its end") {
    const test::ToyWorld world = test::toy_world({2, 2, 1}, 4, 9);
    sim::RadiosityRun finished(world.grid, test::toy_lights(world), options_with(1e-9, 1));
    finished.run();
    const std::vector<Rgb> end = radiosity_of(finished);
    sim::RadiosityRun run(world.grid, test::toy_lights(world), options_with(1e-6, 1));
    std::vector<Rgb> before = radiosity_of(run);
    while (run.simulation().run_one()) {
      // Light only adds: no patch ever passes its end, and none steps back.
      const std::vector<Rgb> now = radiosity_of(run);
      for (std::size_t k = 0; k < now.size(); ++k)
        for (int channel = 0; channel < 3; ++channel) {
          REQUIRE(now[k][channel] >= before[k][channel] - 1e-6);
          REQUIRE(now[k][channel] <= end[k][channel] + 1e-6);
        }
      before = now;
    }
    CHECK(largest_difference(before, end) < left_over);
  }
}
