#include "core/light/view_shaft.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {

constexpr double tolerance = 1e-9;
const Polygon floor_plate{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Polygon ceiling{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};

/// A horizontal rectangle at a height.
Obstruction level(double x0, double y0, double x1, double y1, double z) {
  return obstruction({{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}, {0, 0, 1});
}

}  // namespace

TEST_SUITE("view_shaft") {
  TEST_CASE("view_shaft: what reaches into the hull may hide, what touches it may not") {
    const ViewShaft shaft(floor_plate, ceiling, tolerance);
    CHECK(shaft.may_hold(level(0.2, 0.2, 0.3, 0.3, 0.5)));
    CHECK(shaft.may_hold(level(-5, -5, 5, 5, 0.5)));
    CHECK(shaft.may_hold(level(0.999, 0.5, 2, 0.6, 0.5)));
    CHECK_FALSE(shaft.may_hold(level(1, 0, 2, 1, 0.5)));
    CHECK_FALSE(shaft.may_hold(level(1.2, 0, 2, 1, 0.5)));
    // A wall along one side.
    CHECK_FALSE(shaft.may_hold(obstruction({{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}}, {1, 0, 0})));
  }

  TEST_CASE("view_shaft: between plates of unlike size the hull narrows") {
    const Polygon small{{0.4, 0.4, 1}, {0.4, 0.6, 1}, {0.6, 0.6, 1}, {0.6, 0.4, 1}};
    const ViewShaft shaft(floor_plate, small, tolerance);
    CHECK(shaft.may_hold(level(0, 0, 0.25, 0.25, 0.5)));
    CHECK_FALSE(shaft.may_hold(level(0, 0, 0.15, 0.15, 0.5)));
  }

  TEST_CASE("view_shaft: a polygon hides all only when each line of sight between corners meets it") {
    CHECK(hides_all(level(0, 0, 1, 1, 0.5), floor_plate, ceiling, tolerance));
    CHECK(hides_all(level(-1, -1, 2, 2, 0.9), floor_plate, ceiling, tolerance));
    CHECK_FALSE(hides_all(level(0, 0, 1, 0.99, 0.5), floor_plate, ceiling, tolerance));
    CHECK_FALSE(hides_all(level(0.1, 0.1, 0.9, 0.9, 0.5), floor_plate, ceiling, tolerance));
    // Not between them at all.
    CHECK_FALSE(hides_all(level(-9, -9, 9, 9, 2), floor_plate, ceiling, tolerance));
    // Turned over it hides as much.
    Obstruction turned = level(0, 0, 1, 1, 0.5);
    turned = obstruction(Polygon(turned.corners.rbegin(), turned.corners.rend()), -turned.planes[0].normal);
    CHECK(hides_all(turned, floor_plate, ceiling, tolerance));
  }

  TEST_CASE("view_shaft: outside the umbrae lies what some point may see") {
    const std::vector<Obstruction> halves{level(0, 0, 0.5, 1, 0.5), level(0.5, 0, 1, 1, 0.5)};
    const std::vector<std::uint32_t> both{0, 1};
    const Polygon patch{{0.45, 0.4, 0}, {0.55, 0.4, 0}, {0.55, 0.6, 0}, {0.45, 0.6, 0}};
    double left = 0;
    for (const Polygon& piece : outside_umbrae(halves, both, patch, ceiling, tolerance)) left += area(piece);
    // Their seam is seen at x = 1 - the eye's: from .45 to .55, and each hides all beyond from the whole patch.
    CHECK(left == doctest::Approx(0.1).epsilon(1e-6));
    CHECK(outside_umbrae({}, {}, patch, ceiling, tolerance).size() == 1);
    const std::vector<Obstruction> whole{level(-1, -1, 2, 2, 0.5)};
    CHECK(outside_umbrae(whole, std::vector<std::uint32_t>{0}, patch, ceiling, tolerance).empty());
  }
}
