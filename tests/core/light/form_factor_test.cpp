#include "core/light/form_factor.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/gauss.hpp"
#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;

namespace {

constexpr double pi = std::numbers::pi;

/// Point above a corner of an a x b rectangle at distance 1, parallel [Howell's catalogue B-3].
long double above_corner(long double a, long double b) {
  const long double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * std::numbers::pi_v<long double>);
}

/// Midpoint quadrature of cos cos / (π d²) over the convex polygon's fan of triangles; only what is above the horizon.
double by_quadrature(const Vec3& point, const Vec3& normal, const Polygon& corners, int parts) {
  double sum = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Vec3 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    const Vec3 n = glm::cross(a, b);
    const double piece = 0.5 * glm::length(n) / (parts * parts);
    const Vec3 unit = glm::normalize(n);
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j)
        for (int up = 0; up < (i + j + 1 < parts ? 2 : 1); ++up) {
          const double shift = up ? 2.0 / 3 : 1.0 / 3;
          const Vec3 d = corners[0] + (i + shift) / parts * a + (j + shift) / parts * b - point;
          const double square = glm::dot(d, d);
          const double here = glm::dot(d, normal), there = -glm::dot(d, unit);
          if (here > 0 && there > 0) sum += here * there / (pi * square * square) * piece;
        }
  }
  return sum;
}

const Polygon ceiling{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};  // seen from below

}  // namespace

TEST_SUITE("form_factor") {
  TEST_CASE("form_factor: unit square above a corner is 0.138532") {
    CHECK(form_factor({0, 0, 0}, {0, 0, 1}, ceiling) == doctest::Approx(0.138532).epsilon(1e-5));
    CHECK(form_factor({0, 0, 0}, {0, 0, 1}, ceiling) == doctest::Approx(double(above_corner(1, 1))).epsilon(1e-14));
  }

  TEST_CASE("form_factor: twelve digits hold from very near to very far") {
    for (const double distance : {1e-6, 1e-5, 1e-3, 0.1, 1.0, 10.0, 1e2, 1e3, 1e4}) {
      const Polygon square{{-0.5, -0.5, distance}, {-0.5, 0.5, distance}, {0.5, 0.5, distance}, {0.5, -0.5, distance}};
      const auto half = static_cast<long double>(0.5) / static_cast<long double>(distance);
      const auto expected = static_cast<double>(4 * above_corner(half, half));
      CAPTURE(distance);
      CHECK(std::abs(form_factor({0, 0, 0}, {0, 0, 1}, square) / expected - 1) < 1e-12);
    }
  }

  TEST_CASE("form_factor: the faces of a unit cube have 0.199824896 and 0.200043776") {
    const test::Gauss smooth(12), fine(32);
    const double opposite = smooth.over([&](double x) {
      return smooth.over([&](double y) { return form_factor({x, y, 0}, {0, 0, 1}, ceiling); });
    });
    CHECK(opposite == doctest::Approx(0.199824896).epsilon(1e-8));
    const Polygon wall{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};  // x = 0, seen from +x
    // Steep beside the common edge, so x = t³.
    const double adjacent = fine.over([&](double t) {
      return 3 * t * t * fine.over([&](double y) { return form_factor({t * t * t, y, 0}, {0, 0, 1}, wall); });
    });
    CHECK(adjacent == doctest::Approx(0.200043776).epsilon(1e-5));
  }

  TEST_CASE("form_factor: plates of the tables of validation") {
    const test::Gauss fine(40);
    struct Case {
      double width, depth, value;
    };
    for (const Case& c : {Case{2, 2, 0.415253284}, Case{10, 10, 0.826994522}, Case{1, 2, 0.285875385}}) {
      const Polygon plate{{0, 0, 1}, {0, c.depth, 1}, {c.width, c.depth, 1}, {c.width, 0, 1}};
      const double mean = fine.over([&](double x) {
        return fine.over([&](double y) { return form_factor({x * c.width, y * c.depth, 0}, {0, 0, 1}, plate); });
      });
      CAPTURE(c.width);
      CHECK(mean == doctest::Approx(c.value).epsilon(1e-7));
    }
    for (const Case& c : {Case{1, 2, 0.232852603}, Case{1, 0.5, 0.146186679}, Case{1, 0.1, 0.043251369}}) {
      const Polygon plate{{0, 0, 0}, {0, 1, 0}, {0, 1, c.depth}, {0, 0, c.depth}};
      const double mean = fine.over([&](double t) {
        return 3 * t * t * fine.over([&](double y) { return form_factor({t * t * t, y, 0}, {0, 0, 1}, plate); });
      });
      CAPTURE(c.depth);
      CHECK(mean == doctest::Approx(c.value).epsilon(1e-4));
    }
  }

  TEST_CASE("form_factor: the pieces of a closed room's walls sum to one") {
    Random random(1);
    for (int trial = 0; trial < 60; ++trial) {
      // Points inside look anywhere; every third lies on the floor.
      Vec3 point{0.05 + 0.9 * random.unit(), 0.05 + 0.9 * random.unit(), 0.05 + 0.9 * random.unit()};
      Vec3 normal = reference::random_unit(random);
      if (trial % 3 == 0) point.z = 0, normal = {0, 0, 1};
      const int parts = 1 + static_cast<int>(random.below(8));
      double sum = 0;
      for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true})
          for (int i = 0; i < parts; ++i)
            for (int j = 0; j < parts; ++j) {
              const int u = (axis + 1) % 3, v = (axis + 2) % 3;
              Polygon piece(4);
              for (int k = 0; k < 4; ++k) {
                const int at = high ? 3 - k : k;  // fronts look inwards
                piece[k][axis] = high;
                piece[k][u] = (i + (at == 1 || at == 2)) / double(parts);
                piece[k][v] = (j + (at >= 2)) / double(parts);
              }
              sum += form_factor(point, normal, piece);
            }
      CAPTURE(trial);
      CHECK(std::abs(sum - 1) < 1e-12);
    }
  }

  TEST_CASE("form_factor: below the horizon nothing counts, as quadrature finds") {
    Random random(7);
    int straddling = 0;
    for (int trial = 0; trial < 150; ++trial) {
      const Vec3 normal = reference::random_unit(random);
      const Polygon polygon = reference::random_polygon(random, 2.0 * reference::random_unit(random), 1.2, 0.7);
      double lowest = 1e9, highest = -1e9;
      for (const Vec3& p : polygon)
        lowest = std::min(lowest, glm::dot(p, normal)), highest = std::max(highest, glm::dot(p, normal));
      straddling += lowest < 0 && highest > 0;
      CAPTURE(trial);
      const double factor = form_factor({0, 0, 0}, normal, polygon);
      REQUIRE(factor >= 0);
      REQUIRE(std::abs(factor - by_quadrature({0, 0, 0}, normal, polygon, 150)) < 5e-5);
    }
    CHECK(straddling > 30);
  }

  TEST_CASE("form_factor: nothing from behind, from the own plane, or below the horizon") {
    const Polygon floor{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};  // faces up
    CHECK(form_factor({0.5, 0.5, 0}, {0, 0, 1}, floor) == 0);
    CHECK(form_factor({2, 0.5, 1}, {-1, 0, 0}, ceiling) == 0);    // on its plane
    CHECK(form_factor({0.5, 0.5, 0}, {0, 0, -1}, ceiling) == 0);  // looks away
    CHECK(form_factor({0.5, 0.5, 0}, {0, 0, 1}, ceiling) > 0);
  }

  TEST_CASE("form_factor: touching, a corner at the point itself stays finite") {
    const Polygon wall{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};
    for (const double x : {1e-3, 1e-6, 1e-9, 1e-12}) {
      const double factor = form_factor({x, 0.5, 0}, {0, 0, 1}, wall);
      CHECK(factor == doctest::Approx(0.5).epsilon(2 * x + 1e-9));
    }
    CHECK(std::isfinite(form_factor({0, 0, 0}, {0, 0, 1}, ceiling)));
    const Polygon above{{0, 0, 0}, {0, 1, 1}, {1, 1, 1}};
    const double factor = form_factor({0, 0, 0}, glm::normalize(Vec3{0.1, 0.2, 1}), above);
    CHECK((factor >= 0 && factor <= 1));
  }

  TEST_CASE("form_factor: a visible point lies above the horizon and inside the polygon") {
    Random random(3);
    int found = 0;
    for (int trial = 0; trial < 300; ++trial) {
      const Vec3 point = 0.5 * reference::random_unit(random), normal = reference::random_unit(random);
      const Polygon polygon = reference::random_polygon(random, 1.5 * reference::random_unit(random), 1.0, 0.6);
      double highest = -1e9;
      for (const Vec3& p : polygon) highest = std::max(highest, glm::dot(p - point, normal));
      Vec3 target;
      const bool visible = visible_point(point, normal, polygon, target);
      REQUIRE(visible == (highest > 0));
      if (!visible) continue;
      ++found;
      REQUIRE(glm::dot(target - point, normal) > 0);
      const Vec3 n = newell_vector(polygon);
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec3 edge = polygon[(k + 1) % polygon.size()] - polygon[k];
        REQUIRE(glm::dot(glm::cross(n, edge), target - polygon[k]) > -1e-12);
      }
      REQUIRE(std::abs(glm::dot(glm::normalize(n), target - polygon[0])) < 1e-12);
    }
    CHECK(found > 100);
  }
}
