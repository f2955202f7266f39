#include "core/tracing/shining_place.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "core/light/form_factor.hpp"
#include "core/scene/polygon.hpp"

using namespace lichthof;

TEST_CASE("shining_place: places come as often as they bring light") {
  // A panel of 2 x 2 m right above the point: a strip of a tenth of its area brings far more of its light.
  const Polygon panel{{-1, -1, 0.4}, {-1, 1, 0.4}, {1, 1, 0.4}, {1, -1, 0.4}};
  const Vec3 down{0, 0, -1};
  for (const Vec3& normal : {Vec3{0, 0, 1}, glm::normalize(Vec3{0.8, 0.1, 0.3})})
    for (const Vec3& point : {Vec3{0, 0, 0}, Vec3{0.9, 0.2, 0}, Vec3{-3, 0.5, -1}}) {
      const double whole = form_factor(point, normal, panel);
      const Polygon strip = clipped(std::span<const Vec3>(panel), Vec3{-1, 0, 0}, -0.1, 0.0);
      const double left = form_factor(point, normal, strip) / whole;  // of x < 0.1
      Random random(3);
      constexpr int count = 20000;
      const Vec3 nowhere{9, 9, 9};  // where most of the panel lies below the horizon
      int found = 0, missed = 0;
      for (int i = 0; i < count; ++i) {
        const Vec3 place = shining_place(panel, 4, down, point, normal, nowhere, random);
        missed += place == nowhere;
        REQUIRE((place == nowhere || std::abs(place.z - 0.4) < 1e-12));
        found += place.x < 0.1;
      }
      CHECK(missed < count / 1000);
      CHECK(std::abs(double(found) / count - left) < 4 * std::sqrt(left * (1 - left) / count) + 1e-3);
    }
}

TEST_CASE("shining_place: what does not rise above the horizon is aimed at as told") {
  const Polygon panel{{-1, -1, -0.4}, {-1, 1, -0.4}, {1, 1, -0.4}, {1, -1, -0.4}};
  Random random(3);
  CHECK(shining_place(panel, 4, {0, 0, 1}, {0, 0, 0}, {0, 0, 1}, Vec3{9, 9, 9}, random) == Vec3{9, 9, 9});
}
