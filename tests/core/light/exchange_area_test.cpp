#include "core/light/exchange_area.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "core/light/form_factor.hpp"
#include "core/scene/polygon.hpp"
#include "tests/support/view_factor_references.hpp"

using namespace lichthof;

namespace {

/// What is promised, with plates of about 1 m.
constexpr double promised = 1e-10;

/// A rectangle in the plane z = 0 or, upright, x = 0: seen from +z, from +x.
Polygon lying(double x0, double y0, double x1, double y1) {
  return {{x0, y0, 0}, {x1, y0, 0}, {x1, y1, 0}, {x0, y1, 0}};
}
Polygon upright(double y0, double z0, double y1, double z1) {
  return {{0, y0, z0}, {0, y1, z0}, {0, y1, z1}, {0, y0, z1}};
}
Polygon above(double width, double depth) { return {{0, 0, 1}, {0, depth, 1}, {width, depth, 1}, {width, 0, 1}}; }

}  // namespace

TEST_SUITE("exchange_area") {
  TEST_CASE("exchange_area: opposite plates have the closed form, near and far") {
    CHECK(reference::parallel_plates(1, 1) == doctest::Approx(0.199824896).epsilon(1e-8));  // the printed tables
    for (const double width : {1e-3, 0.1, 1.0, 2.0, 10.0, 1000.0})
      for (const double depth : {0.1, 1.0, 3.0}) {
        CAPTURE(width);
        CAPTURE(depth);
        const double exact = reference::parallel_plates(width, depth) * width * depth;
        const double perimeter = 2 * (width + depth);
        CHECK(std::abs(exchange_area(lying(0, 0, width, depth), above(width, depth)) - exact) <=
              promised * perimeter * perimeter);
      }
    CHECK(std::abs(exchange_area(lying(0, 0, 1, 1), above(1, 1)) - reference::parallel_plates(1, 1)) < 1e-11);
  }

  TEST_CASE("exchange_area: plates with a common edge have the closed form") {
    CHECK(reference::perpendicular_exchange(1, 1) == doctest::Approx(0.200043776).epsilon(1e-8));
    for (const double width : {0.01, 0.5, 1.0, 4.0})
      for (const double height : {0.1, 1.0, 2.0}) {
        CAPTURE(width);
        CAPTURE(height);
        CHECK(std::abs(exchange_area(lying(0, 0, width, 1), upright(0, 0, 1, height)) -
                       reference::perpendicular_exchange(width, height)) < promised);
      }
  }

  TEST_CASE("exchange_area: plates apart follow from those with a common edge, by differences") {
    const auto g = [](double w, double h) { return reference::perpendicular_exchange(w, h); };
    CHECK(std::abs(exchange_area(lying(1, 0, 2, 1), upright(0, 0.5, 1, 1.5)) -
                   (g(2, 1.5) - g(1, 1.5) - g(2, 0.5) + g(1, 0.5))) < promised);
    // Side by side along the edge: half of what the wide pair has beyond its two halves, each half a pair of its own.
    const double wide = 4 * g(0.5, 0.5), halves = 2 * g(1, 1);
    CHECK(std::abs(exchange_area(lying(0, 0, 1, 1), upright(1, 0, 2, 1)) - 0.5 * (wide - halves)) < promised);
  }

  TEST_CASE("exchange_area: each face of a regular tetrahedron sends a third to each other") {
    const std::vector<Vec3> corner{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const Polygon a{corner[0], corner[1], corner[2]}, b{corner[0], corner[3], corner[1]};
    const Vec3 inwards = -(corner[0] + corner[1] + corner[2]);
    const bool turn = glm::dot(newell_vector(a), inwards) < 0;
    const Polygon first = turn ? Polygon(a.rbegin(), a.rend()) : a, second = turn ? Polygon(b.rbegin(), b.rend()) : b;
    CHECK(std::abs(exchange_area(first, second) / area(first) - 1.0 / 3) < promised);
  }

  TEST_CASE("exchange_area: skew triangles agree with quadrature of the form factor") {
    const Polygon first{{0, 0, 0}, {1, 0.1, 0}, {0.2, 0.9, 0}};
    const Polygon second{{0.3, 0.1, 1}, {0.1, 1.2, 1.3}, {1.1, 0.6, 1.5}};
    const double quadrature = reference::integral({0, 1}, [&](double u) {
      return reference::integral({0, 1}, [&](double v) {
        const Vec3 p = first[0] + u * ((1 - v) * (first[1] - first[0]) + v * (first[2] - first[0]));
        return 2 * area(first) * u * form_factor(p, {0, 0, 1}, second);
      });
    });
    CHECK(std::abs(exchange_area(first, second) - quadrature) < promised);
    CHECK(std::abs(exchange_area(second, first) - quadrature) < promised);
  }

  TEST_CASE("exchange_area: small far plates keep their digits to the promise, whatever the scale") {
    const Polygon facing{{0, 0, 10}, {0, 0.01, 10}, {0.01, 0.01, 10}, {0.01, 0, 10}};
    const double far = exchange_area(lying(0, 0, 0.01, 0.01), facing);
    CHECK(std::abs(far - 1e-8 / (std::numbers::pi * 100)) < promised * 0.04 * 0.04);
    for (const double scale : {1e-6, 1e6}) {
      Polygon first = lying(0, 0, 1, 1), second = upright(0, 0, 1, 1);
      for (Vec3& p : first) p *= scale;
      for (Vec3& p : second) p *= scale;
      CHECK(std::abs(exchange_area(first, second) / (scale * scale) - reference::perpendicular_exchange(1, 1)) <
            promised);
    }
  }
}
