#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/scene/polygon.hpp"

using namespace lichthof;

namespace {

/// Area of all pieces together; each must be convex.
double area_of_pieces(const Polygon& polygon) {
  double sum = 0;
  for (const auto& piece : convex_pieces(polygon)) {
    Polygon corners;
    for (const auto i : piece) corners.push_back(polygon[i]);
    CHECK(is_convex(corners));
    sum += area(corners);
  }
  return sum;
}

Polygon star(int corners, double inner) {
  Polygon polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners, r = i % 2 ? 1 : inner;
    polygon.push_back({r * std::cos(angle), 0.6 * r * std::sin(angle), 0.8 * r * std::sin(angle)});
  }
  return polygon;
}

}  // namespace

TEST_SUITE("core") {
  TEST_CASE("convex_pieces: an L is cut once, near the origin and far from it") {
    for (const double far : {0.0, 4.5e6}) {
      const Polygon polygon{{far, far, 0},         {far + 2, far, 0},     {far + 2, far + 1, 0},
                            {far + 1, far + 1, 0}, {far + 1, far + 2, 0}, {far, far + 2, 0}};
      CHECK(convex_pieces(polygon).size() == 2);
      CHECK(area_of_pieces(polygon) == doctest::Approx(3));
    }
  }

  TEST_CASE("convex_pieces: a convex polygon stays whole, straight corners included") {
    const Polygon polygon{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 1, 0}};
    CHECK(convex_pieces(polygon) == std::vector<std::vector<std::uint32_t>>{{0, 1, 2, 3, 4, 5}});
  }

  TEST_CASE("convex_pieces: pieces of stars are convex and lose no area [Hertel83]") {
    for (const int corners : {8, 10, 40, 1000}) {
      const Polygon polygon = star(corners, 0.4);
      CHECK(area_of_pieces(polygon) == doctest::Approx(area(polygon)));
      // At most four times the best: a star's points are its pieces, plus the middle.
      CHECK(convex_pieces(polygon).size() <= static_cast<std::size_t>(2 * corners));
    }
  }

  TEST_CASE("convex_pieces: a hole joined by a bridge stays a hole") {
    const Polygon frame{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0},
                        {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}};
    CHECK(area_of_pieces(frame) == doctest::Approx(12));
  }

  TEST_CASE("convex_pieces: what crosses itself or has no area has no pieces") {
    CHECK(convex_pieces(Polygon{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}).empty());
    Polygon pentagram;
    for (int i = 0; i < 5; ++i)
      pentagram.push_back({std::cos(0.8 * std::numbers::pi * i), std::sin(0.8 * std::numbers::pi * i), 0});
    CHECK(convex_pieces(pentagram).empty());
    CHECK(convex_pieces(Polygon{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}).empty());
    CHECK(convex_pieces(Polygon{{0, 0, 0}, {1, 0, 0}}).empty());
  }
}
