// Whole passes inside this process: the real light behind the real actors.
#include "actors/local_run.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "actors/meter.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace std::chrono_literals;

namespace {

/// Two rooms of 3 x 3 x 2.5 m side by side along x; a doorway in the wall between them; a lamp in the first one.
std::shared_ptr<const Scene> two_rooms() {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = test::add_material(*scene, test::diffuse(0.6));
  const std::uint32_t lamp = test::add_material(*scene, test::luminous(20, 0.2));
  test::add_box(*scene, {0, 0, 0}, {6, 3, 2.5}, wall, true);
  // The wall in the middle, two pieces beside and one above the door.
  test::add_rectangle(*scene, {3, 0, 0}, {0, 1, 0}, {0, 0, 2.5}, wall);
  test::add_rectangle(*scene, {3, 2, 0}, {0, 1, 0}, {0, 0, 2.5}, wall);
  test::add_rectangle(*scene, {3, 1, 2}, {0, 1, 0}, {0, 0, 0.5}, wall);
  test::add_rectangle(*scene, {1, 1, 2.4}, {0, 1, 0}, {1, 0, 0}, lamp);
  return scene;
}

struct Case {
  std::shared_ptr<const Scene> scene = two_rooms();
  std::shared_ptr<const Mesh> mesh;

  explicit Case(double patch_size = 0.5) {
    MeshOptions options;
    options.patch_size = patch_size;
    mesh = std::make_shared<const Mesh>(mesh_of(*scene, options, {}));
  }

  actors::SolveRun run(const CellPosition& cells, unsigned threads = 1, double eps = 1e-3) const {
    actors::SolveRun run;
    run.scene = scene;
    run.mesh = mesh;
    CellsWanted wanted;
    wanted.count = cells[0] * cells[1] * cells[2];
    wanted.along = cells;
    Expected<CellGrid> grid = partition(*mesh, bounds(*scene), wanted);
    REQUIRE(grid);
    run.grid = std::make_shared<const CellGrid>(std::move(*grid));
    run.options.mesh = mesh->options;
    run.options.cells = cells;
    run.options.eps = eps;
    run.parallel = std::make_shared<const Parallel>(threads);
    return run;
  }
};

/// Root mean square over the area of the difference in irradiance, relative to that of the irradiance.
double relative_difference(const Solution& a, const Solution& b) {
  double difference = 0, scale = 0;
  for (std::size_t e = 0; e < a.mesh->elements.size(); ++e) {
    const double area = a.mesh->elements[e].area;
    const Rgb d = Rgb{a.irradiance[e]} - Rgb{b.irradiance[e]};
    difference += area * glm::dot(d, d);
    scale += area * glm::dot(Rgb{b.irradiance[e]}, Rgb{b.irradiance[e]});
  }
  return std::sqrt(difference / scale);
}

/// Irradiance with the estimate of what is still to come.
Solution with_pending(Solution solution) {
  for (std::size_t e = 0; e < solution.irradiance.size(); ++e) solution.irradiance[e] += solution.pending[e];
  return solution;
}

bool same_bits(const Solution& a, const Solution& b) {
  return a.irradiance == b.irradiance && a.direct_irradiance == b.direct_irradiance && a.shot == b.shot && a.pending == b.pending;
}

}  // namespace

TEST_SUITE("local run: first pass") {
  TEST_CASE("local run: four cells reach the light of one cell") {
    const Case rooms;
    const Solution one = actors::solve(rooms.run({1, 1, 1})), four = actors::solve(rooms.run({2, 2, 1}));
    MESSAGE(one.counters.shots << " shots " << four.counters.shots << " shots, " << four.counters.messages << " messages, difference "
                               << relative_difference(four, one) << ", residuals " << one.energy.residual() << " "
                               << four.energy.residual() << ", seconds " << one.seconds_radiosity << " " << four.seconds_radiosity);
    CHECK(one.converged);
    CHECK(four.converged);
    CHECK(one.counters.messages == 0);
    CHECK(four.counters.messages > 0);
    CHECK(relative_difference(four, one) < 0.02);
    CHECK(std::abs(one.energy.residual()) < 0.02);
    CHECK(std::abs(four.energy.residual()) < 0.02);
    CHECK(one.energy.emitted == doctest::Approx(four.energy.emitted));
  }

  TEST_CASE("local run: the same run gives the same bits, with one thread and with two, watched or not") {
    const Case rooms;
    const Solution first = actors::solve(rooms.run({2, 2, 1}));
    for (const unsigned threads : {1u, 2u}) {
      actors::SolveRun run = rooms.run({2, 2, 1}, threads);
      int looks = 0;
      run.progress = [&](const RadiosityProgress&) { ++looks; };
      const Solution again = actors::solve(run);
      CAPTURE(threads);
      CHECK(same_bits(first, again));
      CHECK(first.counters.shots == again.counters.shots);
      CHECK(first.counters.messages == again.counters.messages);
      CHECK(first.counters.bytes_sent == again.counters.bytes_sent);
    }
  }
}
