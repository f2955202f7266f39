#include "core/light/cell_surfaces.hpp"

#include <doctest/doctest.h>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

const Box left{{0, 0, 0}, {3, 3, 2}}, right{{3, 0, 0}, {6, 3, 2}};
constexpr double rim = 0.25;
constexpr int high_x = 1;

/// A box of two cells with a wall across it, 3 m wide and up to the ceiling but for a gap in it.
Scene walled(double x, double gap) {
  Scene scene;
  const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
  test::add_box(scene, {0, 0, 0}, {6, 3, 2}, grey, true);
  test::add_rectangle(scene, {x, 0, 0}, {0, 1, 0}, {0, 0, 2}, grey);
  test::add_rectangle(scene, {x, 1 + gap, 0}, {0, 2 - gap, 0}, {0, 0, 2}, grey);
  return scene;
}

bool is_wall(const Vec3& normal, double at, double x) { return std::abs(normal.x) > 0.5 && std::abs(at - x) < 1e-9; }

}  // namespace

TEST_SUITE("cell surfaces") {
  TEST_CASE("cell surfaces: what is near to a cell is met by its rays, as a whole") {
    for (const double x : {1.0, 2.74, 2.76, 3.0, 3.2, 3.24, 5.0}) {
      CAPTURE(x);
      const Scene scene = walled(x, 0.02);
      const auto met = surfaces_of(scene, right, rim);
      REQUIRE(met);
      double area = 0;
      for (const Surface& surface : *met)
        if (is_wall(surface.normal, surface.corners[0].x, x)) area += 0.5 * glm::length(newell_vector(surface.corners));
      CHECK(area == doctest::Approx(x > 3 - rim ? 5.96 : 0));
    }
  }

  TEST_CASE("cell surfaces: a wall closes a side when its pieces leave no opening") {
    for (const double gap : {0.0, 1e-3, 0.02})
      for (const double x : {2.5, 2.9, 3.0, 3.1}) {
        CAPTURE(gap);
        CAPTURE(x);
        const Scene scene = walled(x, gap);
        const auto own = surfaces_of(scene, left, rim);
        REQUIRE(own);
        for (const CoveringSurface& surface : covering_surfaces(scene, *own, left, rim)) {
          if (!is_wall(surface.normal, surface.corners[0].x, x)) continue;
          CHECK((surface.closes >> high_x & 1) == (gap == 0 && x > 3 - rim));
        }
      }
  }

  TEST_CASE("cell surfaces: a cell that holds all of the scene keeps no copy") {
    CHECK(!surfaces_of(walled(1, 0), {{-1, -1, -1}, {7, 4, 3}}, rim));
  }

  TEST_CASE("cell surfaces: neighbours lie at the side where they touch") {
    CHECK(side_towards(left, right) == high_x);
    CHECK(side_towards(right, left) == 0);
    CHECK(side_towards(left, {{0, 0, 2}, {3, 3, 5}}) == 5);
  }
}
