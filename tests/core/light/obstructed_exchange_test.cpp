#include "core/light/obstructed_exchange.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "core/light/exchange_area.hpp"
#include "tests/support/view_factor_references.hpp"

using namespace lichthof;

namespace {

constexpr double plane_tolerance = 1e-7;  // m
constexpr std::uint64_t most_points = 1000000;

const Polygon floor_plate{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Polygon ceiling{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};

FacingPair plates(std::vector<Obstruction> between) { return {floor_plate, ceiling, {0, 0, 1}, std::move(between)}; }
FacingPair turned(const FacingPair& pair, const Vec3& source_normal) {
  return {pair.source, pair.receiver, source_normal, pair.between};
}

Obstruction square_half_way(double side) {
  const double lo = 0.5 - 0.5 * side, hi = 0.5 + 0.5 * side;
  return obstruction({{lo, lo, 0.5}, {hi, lo, 0.5}, {hi, hi, 0.5}, {lo, hi, 0.5}}, {0, 0, 1});
}
/// On the middle line of the floor, wider than it.
Obstruction wall(double height) {
  return obstruction({{0.5, -2, 0}, {0.5, 3, 0}, {0.5, 3, height}, {0.5, -2, height}}, {1, 0, 0});
}

/// Both ways round: what is estimated is kept, and what is allowed.
void expect_exchange(const FacingPair& pair, const Vec3& source_normal, double exact, double allowed) {
  for (const FacingPair& way : {pair, turned(pair, source_normal)})
    for (const Clear clear : {Clear::contour, Clear::quadrature}) {
      const Exchange e = obstructed_exchange(way, allowed, plane_tolerance, most_points, clear);
      CAPTURE(exact);
      CAPTURE(allowed);
      CAPTURE(e.points);
      CAPTURE(e.error);
      CHECK(e.error <= allowed);
      CHECK(std::abs(e.area - exact) <= std::max(e.error, 1e-9));  // 1e-9: the promise of exchange_area, and a margin
    }
}

}  // namespace

TEST_SUITE("obstructed_exchange") {
  TEST_CASE("obstructed_exchange: without obstruction both ways are the contour's") {
    expect_exchange(plates({}), {0, 0, -1}, reference::parallel_plates(1, 1), 1e-6);
    const Polygon upright{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};
    expect_exchange({floor_plate, upright, {0, 0, 1}, {}}, {1, 0, 0}, reference::perpendicular_exchange(1, 1), 1e-6);
  }

  TEST_CASE("obstructed_exchange: a square half way between plates hides what its integral says") {
    // An obstruction of their own size hides all: the integral must know, too.
    CHECK(reference::hidden_by_square_between_plates(1) ==
          doctest::Approx(reference::parallel_plates(1, 1)).epsilon(1e-10));
    for (const double side : {0.1, 0.3, 0.5, 0.9, 1.0}) {
      const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_square_between_plates(side);
      CAPTURE(side);
      for (const double allowed : {1e-4, 1e-6})
        expect_exchange(plates({square_half_way(side)}), {0, 0, -1}, exact, allowed);
    }
  }

  TEST_CASE("obstructed_exchange: a wall that stands on a plate hides what its integral says") {
    // Up to the other plate it leaves the two pairs on either side of it: half plates opposite each other.
    const double halves = 2 * 0.5 * reference::parallel_plates(0.5, 1);
    CHECK(reference::parallel_plates(1, 1) - reference::hidden_by_wall_between_plates(1) ==
          doctest::Approx(halves).epsilon(1e-9));
    for (const double height : {0.2, 0.5, 0.8, 1.0}) {
      const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_wall_between_plates(height);
      CAPTURE(height);
      expect_exchange(plates({wall(height)}), {0, 0, -1}, exact, 1e-6);
    }
  }

  TEST_CASE("obstructed_exchange: a hair's shadow at the border is not overlooked") {
    // Off every one of the 19 points of the first triangles, as long as they are halved no further.
    for (const double width : {1e-2, 2e-3}) {
      const Obstruction edge =
          obstruction({{-1, 0, 1e-3}, {2, 0, 1e-3}, {2, width, 1e-3}, {-1, width, 1e-3}}, {0, 0, 1});
      const FacingPair pair = plates({edge});
      const Exchange here = obstructed_exchange(pair, 1e-6, plane_tolerance, most_points, Clear::contour);
      const Exchange there =
          obstructed_exchange(turned(pair, {0, 0, -1}), 1e-6, plane_tolerance, most_points, Clear::contour);
      CAPTURE(here.area);
      CAPTURE(there.area);
      CHECK(std::abs(here.area - there.area) <= here.error + there.error);
      // Nothing is seen through it: a strip of its width loses nearly all it sent.
      const double lost = reference::parallel_plates(1, 1) - here.area;
      CHECK(lost > 0.5 * 0.15 * width);
    }
  }

  TEST_CASE("obstructed_exchange: skew obstructions give the same from either side") {
    const Obstruction a = obstruction({{0.1, 0.2, 0.3}, {0.9, 0.3, 0.5}, {0.4, 0.8, 0.7}},
                                      glm::normalize(glm::cross(Vec3{0.8, 0.1, 0.2}, Vec3{0.3, 0.6, 0.4})));
    const Obstruction b = obstruction({{0.6, 0.1, 0.2}, {0.8, 0.9, 0.3}, {0.7, 0.5, 0.9}},
                                      glm::normalize(glm::cross(Vec3{0.2, 0.8, 0.1}, Vec3{0.1, 0.4, 0.7})));
    const FacingPair pair = plates({a, b});
    const Exchange fine = obstructed_exchange(pair, 1e-7, plane_tolerance, most_points, Clear::contour);
    CHECK(fine.area < reference::parallel_plates(1, 1));
    expect_exchange(pair, {0, 0, -1}, fine.area, 2e-6);
  }

  TEST_CASE("obstructed_exchange: it ends at the most points, and says how far it got") {
    const Exchange e = obstructed_exchange(plates({square_half_way(0.3)}), 1e-12, plane_tolerance, 500, Clear::contour);
    CHECK(e.points >= 500);
    CHECK(e.points < 600);
    CHECK(e.error > 1e-12);
  }

  TEST_CASE("obstructed_exchange: things standing on the receiver are counted where they cross it") {
    CHECK(standing_count(plates({}), plane_tolerance) == 0);
    CHECK(standing_count(plates({square_half_way(0.5)}), plane_tolerance) == 0);
    CHECK(standing_count(plates({wall(0.5)}), plane_tolerance) == 1);
    CHECK(standing_count(turned(plates({wall(0.5)}), {0, 0, -1}), plane_tolerance) == 0);
    CHECK(standing_count(turned(plates({wall(1.0)}), {0, 0, -1}), plane_tolerance) == 1);
  }
}
