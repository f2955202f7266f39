#include "core/light/bit_projector.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;
using reference::LocalPolygon;
using reference::random_frame;
using reference::random_polygon;
using reference::random_unit;
using reference::upright_frame;

namespace {

struct Comparison {
  std::uint32_t wrong = 0;      // pixels that differ though they are not at an edge
  std::uint32_t undecided = 0;  // pixels whose ray passes an edge's line nearer than 1e-9
  std::uint32_t inside = 0;
};

/// Projects the polygon alone and compares every pixel with its ray.
void compare(const HemicubeFrame& frame, const Polygon& polygon, std::uint32_t resolution, Comparison& result) {
  HemicubeBitmap bitmap(resolution);
  project(frame, polygon, bitmap);
  const LocalPolygon local(frame, polygon);
  for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
    const LocalPolygon::Meeting meeting = local.meeting(pixel_direction(pixel, resolution));
    if (meeting.undecided) {
      ++result.undecided;
      continue;
    }
    result.inside += meeting.inside;
    result.wrong += meeting.inside != bitmap.covered(pixel);
  }
}

}  // namespace

TEST_CASE("bit_projector: random polygons cover exactly the pixels whose rays meet them") {
  Random random(1);
  Comparison all;
  for (int i = 0; i < 3000; ++i) {
    const HemicubeFrame frame = random_frame(random, {3, -2, 1});
    const Vec3 centre = frame.centre + (0.05 + 3 * random.unit()) * random_unit(random);
    compare(frame, random_polygon(random, centre, 0.02 + 4 * random.unit() * random.unit(), 1.0), i % 10 == 0 ? 64 : 20,
            all);
  }
  CHECK(all.wrong == 0);
  CHECK(all.inside > 100000);
  CHECK(all.undecided < 10);
}

TEST_CASE("bit_projector: slivers, dots and sheets of any size cover exactly the pixels whose rays meet them") {
  Random random(2);
  Comparison all;
  for (int i = 0; i < 3000; ++i) {
    const HemicubeFrame frame = random_frame(random, {0.1, 0.2, 0.3});
    const double distance = std::pow(10.0, -6 + 12 * random.unit());
    const double size = distance * std::pow(10.0, -3 + 6 * random.unit());
    const double thickness = std::pow(10.0, -5 * random.unit());
    compare(frame, random_polygon(random, frame.centre + distance * random_unit(random), size, thickness), 20, all);
  }
  CHECK(all.wrong == 0);
  CHECK(all.inside > 20000);
  CHECK(all.undecided < 30);
}

TEST_CASE("bit_projector: polygons around the centre and through the base plane need no clipping") {
  Random random(3);
  Comparison all;
  for (int i = 0; i < 1500; ++i) {
    const HemicubeFrame frame = random_frame(random, {1, 1, 1});
    // The plane passes the centre at a small distance, and the polygon reaches around it on all sides.
    const double distance = std::pow(10.0, -7 * random.unit());
    Polygon polygon = random_polygon(random, frame.centre, 1.0 + random.unit(), 1.0);
    const Vec3 normal = glm::normalize(newell_vector(polygon));
    for (Vec3& p : polygon) p += distance * normal;
    compare(frame, polygon, 20, all);
  }
  CHECK(all.wrong == 0);
  CHECK(all.inside > 300000);
}

TEST_CASE("bit_projector: polygons that share edges leave no gap") {
  // A planar mesh of quadrilaterals around random points, in a random plane near and far, larger than the view:
  // together they must cover what their outline covers, and here that is every pixel which looks at the plane.
  Random random(4);
  for (int i = 0; i < 60; ++i) {
    const HemicubeFrame frame = random_frame(random, {7, 8, 9});
    const double distance = std::pow(10.0, -4 + 6 * random.unit());
    Vec3 normal = random_unit(random), u, v;
    complete_frame(normal, u, v);
    constexpr int n = 12;
    Vec3 grid[n + 1][n + 1];
    for (int row = 0; row <= n; ++row) {
      for (int column = 0; column <= n; ++column) {
        const double inner = row > 0 && row < n && column > 0 && column < n ? 0.3 : 0.0;
        const double x = column - 0.5 * n + inner * (random.unit() - 0.5),
                     y = row - 0.5 * n + inner * (random.unit() - 0.5);
        grid[row][column] = frame.centre + distance * (normal + x * u + y * v);
      }
    }
    HemicubeBitmap pieces(64), outline(64);
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) {
        // Halves of a cell of the grid: triangles are convex whatever the random shifts.
        project(frame, Polygon{grid[row][column], grid[row][column + 1], grid[row + 1][column + 1]}, pieces);
        project(frame, Polygon{grid[row][column], grid[row + 1][column + 1], grid[row + 1][column]}, pieces);
      }
    }
    project(frame, Polygon{grid[0][0], grid[0][n], grid[n][n], grid[n][0]}, outline);
    CHECK(pieces == outline);
  }
}

TEST_CASE("bit_projector: a corner on the middle of a neighbour's edge leaves no gap") {
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    const HemicubeFrame frame = random_frame(random, {100, 200, 300});
    const Vec3 a = frame.centre + 5.0 * random_unit(random), b = frame.centre + 5.0 * random_unit(random);
    const Vec3 c = frame.centre + 5.0 * random_unit(random);
    const Vec3 middle = a + random.unit() * (b - a);  // rounded, so not exactly on the edge
    HemicubeBitmap whole(128), parts(128);
    project(frame, Polygon{a, b, c}, whole);
    project(frame, Polygon{a, middle, c}, parts);
    project(frame, Polygon{middle, b, c}, parts);
    HemicubeBitmap both = whole;
    both.merge(parts);
    CHECK(both == parts);
  }
}

TEST_CASE("bit_projector: an edge through pixel centres leaves no gap, whatever corners rounding puts on it") {
  // Two polygons meet along an edge that runs through the centres of a column of pixels, or past them as near as
  // rounding matters. One has the whole edge, the other has further corners on it: somewhere, and next to an end, where
  // the direction of the short piece is rounded most.
  Random random(10);
  constexpr std::uint32_t resolution = 64;
  std::uint32_t gaps = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t column = 8 + random.below(48);
    const double a = (column + 0.5) * 2 / resolution - 1 - (i % 3 ? std::pow(10.0, -9 * random.unit() - 7) : 0.0);
    const double near = std::pow(10.0, 4 * random.unit() - 2), far = near * (0.5 + random.unit());
    const auto tilt = [&](double x, double y, double w) {
      return i % 2 ? Vec3{x, y, w} : Vec3{w, x, y + w};
    };  // top or side
    const auto at = [&](double x, double y, double w) { return tilt(x * w, (i % 2 ? y : 0.4 * y - 0.5) * w, w); };
    const Vec3 p = at(a, -0.9, near), q = at(a, 0.9, far);
    const Vec3 middle = p + (0.01 + 0.9 * random.unit()) * (q - p),
               next = p + std::pow(10.0, -6 * random.unit() - 3) * (q - p);
    HemicubeBitmap bitmap(resolution);
    project(upright_frame({0, 0, 0}), Polygon{p, q, at(a - 0.2, 0.9, far), at(a - 0.2, -0.9, near)}, bitmap);
    const Vec3 right = at(a + 0.2, 0.9, far), left = at(a + 0.2, -0.9, near);
    project(upright_frame({0, 0, 0}), Polygon{p, next, middle, q, right, left}, bitmap);
    const std::uint32_t face = i % 2 ? 0 : 1, rows = face_rows(face, resolution);
    for (std::uint32_t row = rows / 4; row < rows * 3 / 4; ++row) {
      const std::uint32_t pixel = first_pixel_of(face, resolution) + row * resolution + column;
      gaps += !bitmap.covered(pixel - 1) || !bitmap.covered(pixel) || !bitmap.covered(pixel + 1);
    }
  }
  CHECK(gaps == 0);
}

TEST_CASE("bit_projector: pixel centres exactly on an edge are covered") {
  const HemicubeFrame frame = upright_frame({0, 0, 0});
  const double a = 1.0 / 8;  // centre of the first column right of the middle, R = 8
  HemicubeBitmap bitmap(8);
  project(frame, Polygon{{a, -a, 1}, {3 * a, -a, 1}, {3 * a, 3 * a, 1}, {a, 3 * a, 1}}, bitmap);
  CHECK(bitmap.covered_count() == 2 * 3);
  HemicubeBitmap side(8);
  project(frame, Polygon{{1, -a, a}, {1, a, a}, {1, a, 5 * a}, {1, -a, 5 * a}}, side);
  CHECK(side.covered_count() == 2 * 3);
}

TEST_CASE("bit_projector: nothing behind or in the base plane covers anything") {
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const HemicubeFrame frame = random_frame(random, {40, -70, 11});
    const auto at = [&](double x, double y, double z) { return frame.centre + frame.to_world({x, y, z}); };
    HemicubeBitmap bitmap(32);
    project(frame, Polygon{at(-1, -1, 0), at(1, -1, 0), at(1, 1, 0), at(-1, 1, 0)},
            bitmap);  // the shooter's own surface
    project(frame, Polygon{at(1, 1, 0), at(50, 3, 0), at(4, 60, 0)}, bitmap);
    project(frame, Polygon{at(-1, -1, -0.1), at(1, -1, -0.1), at(1, 1, -2)}, bitmap);
    project(frame, Polygon{at(-1, -1, 0), at(1, -1, 0), at(1, 1, -2)}, bitmap);
    CHECK(bitmap.covered_count() == 0);
  }
  // Surfaces are flat within 1e-6 of their size only: the own one may rise by that much before the centre.
  for (int i = 0; i < 200; ++i) {
    const auto lift = [&] { return 2e-6 * random.unit(); };
    const HemicubeFrame frame = upright_frame({0, 0, 0});
    HemicubeBitmap bitmap(32);
    project(frame, Polygon{{-1, -1, lift()}, {1, -1, lift()}, {1, 1, lift()}, {-1, 1, lift()}}, bitmap);
    CHECK(bitmap.covered_count() == 0);
  }
  // The same surface, lifted by one unit of the last place.
  for (const double height : {0.3, 1000.3, 1e6 + 0.3}) {
    const double lifted = std::nextafter(height, 1e9);
    HemicubeBitmap bitmap(32);
    project(upright_frame({5, 5, height}), Polygon{{0, 0, lifted}, {9, 0, lifted}, {9, 9, lifted}, {0, 9, lifted}},
            bitmap);
    CHECK(bitmap.covered_count() == 0);
  }
}

TEST_CASE("bit_projector: a closed room is covered without a gap, wherever the shooter stands") {
  Random random(7);
  const Box room{{-3, 2, 0}, {5, 9, 2.5}};
  const auto corner = [&](int i) {
    return Vec3{i & 1 ? room.hi.x : room.lo.x, i & 2 ? room.hi.y : room.lo.y, i & 4 ? room.hi.z : room.lo.z};
  };
  constexpr int sides[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  for (int i = 0; i < 200; ++i) {
    const Vec3 share{random.unit(), random.unit(), random.unit()};
    const HemicubeFrame frame = random_frame(random, room.lo + share * room.size());
    HemicubeBitmap bitmap(128);
    for (const auto& side : sides)
      project(frame, Polygon{corner(side[0]), corner(side[1]), corner(side[2]), corner(side[3])}, bitmap);
    CHECK(bitmap.covered_count() == pixel_count(128));
  }
}

TEST_CASE("bit_projector: an edge-on polygon has no inside") {
  HemicubeBitmap bitmap(64);
  project(upright_frame({0, 0, 0}), Polygon{{1, 0, 0}, {2, 0, 0}, {2, 0, 2}, {1, 0, 2}}, bitmap);
  project(upright_frame({0, 0, 0}), Polygon{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, bitmap);
  CHECK(bitmap.covered_count() == 0);
}

TEST_CASE("bit_projector: a disc of many corners is its fan") {
  Polygon disc;
  for (int i = 0; i < 100; ++i) disc.push_back({std::cos(0.0628 * i), 0.3 + std::sin(0.0628 * i), 0.7});
  Comparison all;
  compare(upright_frame({0, 0, 0}), disc, 64, all);
  CHECK(all.wrong == 0);
  CHECK(all.inside > 1000);
}

TEST_CASE("bit_projector: winding does not matter") {
  Random random(8);
  for (int i = 0; i < 100; ++i) {
    const HemicubeFrame frame = random_frame(random, {0, 0, 0});
    const Polygon polygon = random_polygon(random, random_unit(random), 1.0, 1.0);
    const Polygon reversed(polygon.rbegin(), polygon.rend());
    HemicubeBitmap one(32), other(32);
    project(frame, polygon, one);
    project(frame, reversed, other);
    CHECK(one == other);
  }
}

TEST_CASE("bit_projector: a surface between shooter and the cells beyond may shadow, others can not") {
  const Box beyond{{4, 0, 0}, {8, 4, 3}};
  const Vec3 shooter{1, 1, 1};
  CHECK_FALSE(can_not_shadow({2, 0, 0}, {1, 0, 0}, shooter, beyond));
  CHECK_FALSE(can_not_shadow({2, 0, 0}, {-1, 0, 0}, shooter, beyond));
  CHECK_FALSE(can_not_shadow({5, 0, 0}, {1, 0, 0}, shooter, beyond));  // cuts the box
  CHECK(can_not_shadow({0, 0, 0}, {1, 0, 0}, shooter, beyond));        // behind the shooter
  CHECK(can_not_shadow({0, 0, 0}, {0, 0, 1}, shooter, beyond));        // the floor of both
  CHECK(can_not_shadow({0, 0, 3}, {0, 0, -1}, shooter, beyond));       // the ceiling of both
  CHECK(can_not_shadow({1, 1, 1}, {0.6, 0.8, 0}, shooter, beyond));    // edge-on
  CHECK(can_not_shadow({9, 0, 0}, {1, 0, 0}, shooter, beyond));        // beyond the beyond
  CHECK(can_not_shadow({2, 0, 0}, {1, 0, 0}, shooter, Box{}));         // nothing beyond
  CHECK(can_not_shadow({0, 0, 1e-9}, {0, 0, 1}, shooter, beyond));     // walls and boxes agree within rounding only
  CHECK(can_not_shadow({0, 0, 0}, {0, 1e-9, 1}, shooter, beyond));
  CHECK_FALSE(can_not_shadow({0, 0, 1e-3}, {0, 0, 1}, shooter, beyond));
  // A wall on the border between the cells does shadow, a wall on the far border does not; nor at any scale or place.
  for (const double scale : {1e-3, 1.0, 1e4}) {
    for (const double shift : {0.0, 1e3}) {
      const auto at = [&](double x, double y, double z) { return scale * (Vec3{x, y, z} + shift); };
      const Box moved{at(4, 0, 0), at(8, 4, 3)};
      CHECK_FALSE(can_not_shadow(at(4, 0, 0), {1, 0, 0}, at(1, 1, 1), moved));
      CHECK(can_not_shadow(at(8, 0, 0), {-1, 0, 0}, at(1, 1, 1), moved));
      CHECK(can_not_shadow(at(0, 4, 0), {0, -1, 0}, at(1, 1, 1), moved));
    }
  }
}

TEST_CASE("bit_projector: what can not shadow hides no point beyond") {
  Random random(9);
  std::uint32_t skipped = 0, wrong = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 shooter = 3.0 * random_unit(random), lo = 4.0 * random_unit(random);
    const Box beyond{lo, lo + Vec3{random.unit(), random.unit(), random.unit()}};
    const Vec3 normal = random_unit(random), point = 3.0 * random_unit(random);
    if (!can_not_shadow(point, normal, shooter, beyond)) continue;
    ++skipped;
    for (int k = 0; k < 20; ++k) {
      const Vec3 target = beyond.lo + Vec3{random.unit(), random.unit(), random.unit()} * beyond.size();
      const double from = glm::dot(normal, shooter - point), to = glm::dot(normal, target - point);
      wrong += from * to < -1e-6;
    }
  }
  CHECK(skipped > 1000);
  CHECK(wrong == 0);
}
