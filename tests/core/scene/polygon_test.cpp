#include "core/scene/polygon.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;

namespace {

Polygon moved(Polygon polygon, const Vec3& by) {
  for (Vec3& p : polygon) p += by;
  return polygon;
}

const Polygon square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Polygon ell{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
const Polygon star = [] {
  Polygon corners;
  for (int k = 0; k < 5; ++k) {
    const double angle = 2 * std::numbers::pi * 2 * k / 5;
    corners.push_back({std::cos(angle), std::sin(angle), 0});
  }
  return corners;
}();

}  // namespace

TEST_SUITE("polygon") {
  TEST_CASE("polygon: Newell's vector is the normal times twice the area, concave or not") {
    CHECK(newell_vector(square) == Vec3{0, 0, 2});
    CHECK(newell_vector(ell) == Vec3{0, 0, 8});
    CHECK(area(ell) == 4);
    CHECK(newell_vector(Polygon(ell.rbegin(), ell.rend())) == Vec3{0, 0, -8});
    CHECK(signed_area(Polygon2{{0, 0}, {2, 0}, {0, 2}}) == 2);
    CHECK(signed_area(Polygon2{{0, 2}, {2, 0}, {0, 0}}) == -2);
  }

  TEST_CASE("polygon: area, centre and shape keep their digits far from the origin") {
    const Vec3 far{1e6, -2e6, 3e6};
    CHECK(area(moved(ell, far)) == doctest::Approx(4).epsilon(1e-12));
    CHECK(glm::length(centroid(moved(ell, far)) - far - centroid(ell)) < 1e-8);
    CHECK(is_convex(moved(square, far)));
    CHECK(flatness_defect(moved(ell, far)) < 1e-9);
  }

  TEST_CASE("polygon: the centre of gravity is that of the area, not of the corners") {
    // An L of a 2 x 1 and a 1 x 2 rectangle.
    CHECK(glm::length(centroid(ell) - Vec3{(2 * 1 + 2 * 0.5) / 4, (2 * 0.5 + 2 * 2) / 4, 0}) < 1e-15);
    const Polygon2 with_extra_corners{{0, 0}, {0.1, 0}, {0.2, 0}, {1, 0}, {1, 1}, {0, 1}};
    CHECK(glm::length(centroid(with_extra_corners) - Vec2{0.5, 0.5}) < 1e-15);
  }

  TEST_CASE("polygon: flatness is the largest distance from the plane") {
    CHECK(flatness_defect(square) == 0);
    const Polygon bent{{0, 0, 0.01}, {1, 0, -0.01}, {1, 1, 0.01}, {0, 1, -0.01}};
    CHECK(flatness_defect(bent) == doctest::Approx(0.01).epsilon(1e-3));
  }

  TEST_CASE("polygon: convex ones turn left everywhere, and once round") {
    CHECK(is_convex(square));
    CHECK(is_convex(Polygon(square.rbegin(), square.rend())));  // seen from its own front
    CHECK(is_convex(Polygon{{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    CHECK_FALSE(is_convex(ell));
    CHECK_FALSE(is_convex(star));
    Random random(6);
    for (int k = 0; k < 200; ++k) CHECK(is_convex(reference::random_polygon(random, {3, 4, 5}, 2.0, 0.3)));
  }

  TEST_CASE("polygon: a line cuts a convex polygon into two parts that make up the whole") {
    Random random(2);
    for (int k = 0; k < 500; ++k) {
      const Polygon whole = reference::random_polygon(random, {1, 2, 3}, 1.0, 0.5);
      const Vec3 normal = reference::random_unit(random);
      const double offset = glm::dot(normal, Vec3{1, 2, 3}) + 1.2 * (random.unit() - 0.5);
      const Polygon above = clipped(whole, normal, offset, 0), below = clipped(whole, -normal, -offset, 0);
      REQUIRE((above.empty() ? 0 : area(above)) + (below.empty() ? 0 : area(below)) ==
              doctest::Approx(area(whole)).epsilon(1e-12));
      for (const Vec3& p : above) REQUIRE(glm::dot(normal, p) >= offset - 1e-12);
      for (const Vec3& p : below) REQUIRE(glm::dot(normal, p) <= offset + 1e-12);
      if (!above.empty()) {
        REQUIRE(above.size() <= whole.size() + 1);
        REQUIRE(glm::dot(newell_vector(above), newell_vector(whole)) > 0);
      }
    }
  }

  TEST_CASE("polygon: corners near the line count as on it") {
    const double tolerance = 1e-6;
    CHECK(clipped(square, {1, 0, 0}, 1e-7, tolerance) == square);              // nothing to cut
    CHECK(clipped(square, {-1, 0, 0}, -1e-7, tolerance).empty());              // nothing beyond
    CHECK(clipped(square, {1, 0, 0}, 2, tolerance).empty());
    CHECK(clipped(square, {1, 0, 0}, -2, tolerance) == square);
    CHECK(clipped(square, {1, 0, 0}, 1, 0).empty());                           // an edge is no piece
    const Polygon2 half = clipped(Polygon2{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, Vec2{0, 1}, 0.5, tolerance);
    CHECK(signed_area(half) == doctest::Approx(0.5));
  }

  TEST_CASE("polygon: neighbours that share an edge get the same corner bit for bit") {
    Random random(12);
    for (int k = 0; k < 200; ++k) {
      const auto point = [&] { return Vec3{random.unit(), random.unit(), 0}; };
      const Vec3 a = point(), b = point();
      const Polygon one{a, b, {-2, 3, 0}}, other{b, a, {3, -2, 0}};
      const double line = 0.5 * (a.x + b.x);
      if (std::abs(a.x - b.x) < 1e-3) continue;
      const auto on_edge = [&](const Polygon& piece) {
        Vec3 nearest{1e300};
        for (const Vec3& p : piece)
          if (glm::length(p - 0.5 * (a + b)) < glm::length(nearest - 0.5 * (a + b))) nearest = p;
        return nearest;
      };
      const Vec3 p = on_edge(clipped(one, {1, 0, 0}, line, 0)), q = on_edge(clipped(other, {1, 0, 0}, line, 0));
      CHECK(p == q);
    }
  }
}
