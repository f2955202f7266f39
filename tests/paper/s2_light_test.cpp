/// §2: what the radiosity equation says, on scenes whose answer is known. Each case: the scene, the steps, what must come out.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/tracing/column_tracer.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// Howell's catalogue, C-11 and C-14: faces of the unit cube.
constexpr double opposite_faces = 0.199824896, adjacent_faces = 0.200043776;

}  // namespace

TEST_SUITE("paper §2") {
  TEST_CASE("§2: in a closed box of one reflectance every patch ends at E/(1-ρ)") {
    auto scene = std::make_shared<Scene>();
    const double radiance = 2, reflectance = 0.7, exitance = std::numbers::pi * radiance;
    add_box(*scene, {0, 0, 0}, {3, 1, 0.5}, add_material(*scene, luminous(radiance, reflectance)), true);
    OneCell cell(scene, mesh_with(*scene, 0.25));
    cell.solve(1e-6);
    const Solution solution = cell.solution();
    for (const Patch& patch : solution.mesh->patches) {
      if (patch.back) continue;
      double received = 0, area = 0;
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        received += solution.mesh->elements[e].area * (solution.irradiance[e].x + solution.pending[e].x);
        area += solution.mesh->elements[e].area;
      }
      // The flat box has corners where a patch sees itself at a slant in two walls: the midpoint rule's error there.
      REQUIRE(exitance + reflectance * received / area == doctest::Approx(exitance / (1 - reflectance)).epsilon(2e-3));
    }
  }

  TEST_CASE("§2: of a patch's energy the closed room receives all, each wall its form factor") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t black = add_material(*scene, diffuse(0)), lamp = add_material(*scene, luminous(1));
    add_box(*scene, {0, 0, 0}, {1, 1, 1}, black, true);
    const std::uint32_t floor = 4;
    scene->surfaces[floor].material = lamp;
    OneCell cell(scene, mesh_with(*scene, 0.1, false));
    cell.solve(1e-4);
    const Solution solution = cell.solution();
    std::array<double, 6> received{};
    for (const Patch& patch : solution.mesh->patches)
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
        if (!patch.back) received[patch.surface.value] += solution.mesh->elements[e].area * solution.irradiance[e].x;
    const double emitted = std::numbers::pi;
    double sum = 0;
    for (std::uint32_t wall = 0; wall < 6; ++wall) {
      const double expected = wall == floor ? 0 : wall == floor + 1 ? opposite_faces : adjacent_faces;
      CAPTURE(wall);
      // 40 elements along an edge: the error of the midpoint rule, which falls with their square, is 3e-5 there.
      CHECK(received[wall] / emitted == doctest::Approx(expected).epsilon(1e-3));
      sum += received[wall] / emitted;
    }
    CHECK(sum == doctest::Approx(1).epsilon(1e-3));
  }

  TEST_CASE("§2: one solution serves every camera") {
    const std::shared_ptr<const Scene> scene = two_rooms();
    OneCell cell(scene, mesh_with(*scene, 0.5));
    cell.solve(1e-3);
    const auto lit = std::make_shared<LitScene>(cell.solution());
    // Four eyes in both rooms and in the door look at the same points: what they see there is the same.
    const std::array<Vec3, 4> eyes{Vec3{0.5, 0.5, 1.5}, {3, 3.5, 0.4}, {3.7, 2, 1.9}, {2.2, 0.3, 2.2}};
    const std::array<Vec3, 3> points{Vec3{0.001, 2.13, 1.37}, {1.03, 1.17, 0}, {2.41, 3.999, 1.21}};
    for (const Vec3& point : points) {
      Rgbf first{0.f};
      for (std::size_t k = 0; k < eyes.size(); ++k) {
        const PinholeCamera film({"", eyes[k], point, {0, 0, 1}, 1}, 1, 1);
        const ColumnTracer source(lit, film, {TracingMethod::radiosity, 1, 1, 1e-3, 4, 0, {}},
                                  std::make_shared<Parallel>(1));
        std::uint64_t rays = 0;
        const Rgbf seen = source.columns({0, 1}, rays)[0];
        if (k == 0) first = seen;
        CAPTURE(k);
        REQUIRE(first.x > 0);
        // The one sample lies anywhere in a pixel of 1 degree: a few centimetres on the wall.
        for (int c = 0; c < 3; ++c) CHECK(seen[c] == doctest::Approx(first[c]).epsilon(0.05));
      }
    }
  }
}
