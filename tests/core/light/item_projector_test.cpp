#include "core/light/item_projector.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "core/light/bit_projector.hpp"
#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;
using reference::LocalPolygon;
using reference::random_frame;
using reference::random_polygon;
using reference::random_unit;
using reference::upright_frame;

namespace {

struct Nearest {
  std::uint32_t item = ItemBuffer::no_item;
  double inverse_depth = 0;
  bool undecided = false;  // at an outline, or two polygons at the same depth
};

Nearest nearest(const std::vector<LocalPolygon>& polygons, const Vec3& direction) {
  Nearest result;
  double second = 0;
  for (std::uint32_t i = 0; i < polygons.size(); ++i) {
    const LocalPolygon::Meeting meeting = polygons[i].meeting(direction);
    result.undecided |= meeting.undecided;
    if (!meeting.inside) continue;
    const auto inverse_depth = static_cast<double>(1 / meeting.t);
    if (inverse_depth > result.inverse_depth) {
      second = result.inverse_depth;
      result.inverse_depth = inverse_depth, result.item = i;
    } else {
      second = std::max(second, inverse_depth);
    }
  }
  result.undecided |= result.inverse_depth - second < 1e-6 * result.inverse_depth;  // single precision
  return result;
}

/// A scene of polygons that pierce each other, in all distances.
std::vector<Polygon> random_scene(Random& random, const Vec3& centre, int count) {
  std::vector<Polygon> scene;
  for (int i = 0; i < count; ++i) {
    const double distance = std::pow(10.0, -1 + 2 * random.unit());
    scene.push_back(
        random_polygon(random, centre + distance * random_unit(random), distance * (0.2 + random.unit()), 1.0));
  }
  return scene;
}

}  // namespace

TEST_CASE("item_projector: every pixel holds the polygon that its ray meets first") {
  Random random(1);
  std::uint32_t wrong = 0, deep = 0, undecided = 0, held = 0;
  for (int i = 0; i < 60; ++i) {
    const std::uint32_t resolution = 32;
    const HemicubeFrame frame = random_frame(random, {1, 2, 3});
    const std::vector<Polygon> scene = random_scene(random, frame.centre, 20);
    ItemBuffer buffer(resolution);
    std::vector<LocalPolygon> polygons;
    for (std::uint32_t k = 0; k < scene.size(); ++k) {
      buffer.project(frame, scene[k], k);
      polygons.emplace_back(frame, scene[k]);
    }
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
      const Nearest expected = nearest(polygons, pixel_direction(pixel, resolution));
      held += expected.item != ItemBuffer::no_item;
      undecided += expected.undecided && expected.item != ItemBuffer::no_item;
      if (expected.undecided) continue;
      wrong += buffer.item(pixel) != expected.item;
      deep += std::abs(buffer.inverse_depth(pixel) - expected.inverse_depth) > 1e-6 * expected.inverse_depth;
    }
  }
  CHECK(wrong == 0);
  CHECK(deep == 0);
  CHECK(held > 50000);
  CHECK(undecided < 50);
}

TEST_CASE("item_projector: a plane seen at a grazing angle keeps its depth from near to far") {
  // A floor 1e-3 below an object that stands upon it, from 1 mm to 10 m away.
  const HemicubeFrame frame = upright_frame({0, 0, 0});
  ItemBuffer buffer(128);
  const Polygon wall{{1e-3, -20, 0}, {20, 20, 0}, {20, 20, 20}, {1e-3, -20, 20}};
  buffer.project(frame, wall, 7);
  const LocalPolygon local(frame, wall);
  double worst = 0;
  for (std::uint32_t pixel = 0; pixel < pixel_count(128); ++pixel) {
    const LocalPolygon::Meeting meeting = local.meeting(pixel_direction(pixel, 128));
    if (!meeting.inside || meeting.undecided) continue;
    REQUIRE(buffer.item(pixel) == 7);
    worst = std::max(worst, static_cast<double>(std::abs(buffer.inverse_depth(pixel) * meeting.t - 1)));
  }
  CHECK(worst < 1e-6);
}

TEST_CASE("item_projector: the order of projection does not matter") {
  Random random(2);
  const HemicubeFrame frame = random_frame(random, {0, 0, 0});
  const std::vector<Polygon> scene = random_scene(random, frame.centre, 30);
  ItemBuffer forwards(64), backwards(64);
  for (std::uint32_t k = 0; k < 30; ++k)
    forwards.project(frame, scene[k], k), backwards.project(frame, scene[29 - k], 29 - k);
  std::uint32_t different = 0;
  for (std::uint32_t pixel = 0; pixel < pixel_count(64); ++pixel)
    different += forwards.item(pixel) != backwards.item(pixel);
  CHECK(different == 0);
}

TEST_CASE("item_projector: covered pixels of the incoming bitmap take no item") {
  Random random(3);
  const HemicubeFrame frame = random_frame(random, {0, 0, 0});
  HemicubeBitmap incoming(64);
  project(frame, random_polygon(random, frame.centre + frame.normal, 0.7, 1.0), incoming);
  REQUIRE(incoming.covered_count() > 100);
  ItemBuffer free(64), restricted(64);
  restricted.clear(incoming);
  for (const Polygon& polygon : random_scene(random, frame.centre, 20)) {
    free.project(frame, polygon, 5), restricted.project(frame, polygon, 5);
  }
  for (std::uint32_t pixel = 0; pixel < pixel_count(64); ++pixel) {
    REQUIRE(restricted.item(pixel) == (incoming.covered(pixel) ? ItemBuffer::nearer_cell : free.item(pixel)));
  }
  restricted.clear();
  CHECK(restricted.item(0) == ItemBuffer::no_item);
}

TEST_CASE("item_projector: the buffer's bitmap is what the bit projector makes of the same polygons") {
  Random random(4);
  for (int i = 0; i < 30; ++i) {
    const HemicubeFrame frame = random_frame(random, {5, 5, 5});
    HemicubeBitmap incoming(62), bits(62);
    project(frame, random_polygon(random, frame.centre + random_unit(random), 1.0, 1.0), incoming);
    bits = incoming;
    ItemBuffer buffer(62);
    buffer.clear(incoming);
    std::uint32_t item = 0;
    for (const Polygon& polygon : random_scene(random, frame.centre, 10)) {
      buffer.project(frame, polygon, item++);
      project(frame, polygon, bits);
    }
    HemicubeBitmap bitmap(62);
    buffer.cover(bitmap);
    CHECK(bitmap == bits);
  }
}

TEST_CASE("item_projector: a sample point is seen when its pixel holds its own plane") {
  const HemicubeFrame frame = upright_frame({0, 0, 0});
  ItemBuffer buffer(64);
  // A ceiling of two patches in plane 3, and a table in plane 4 that hides the left one.
  const std::uint32_t plane_of_item[] = {3, 3, 4};
  buffer.project(frame, Polygon{{-2, -2, 2}, {0, -2, 2}, {0, 2, 2}, {-2, 2, 2}}, 0);
  buffer.project(frame, Polygon{{0, -2, 2}, {2, -2, 2}, {2, 2, 2}, {0, 2, 2}}, 1);
  buffer.project(frame, Polygon{{-1, -1, 1}, {-0.1, -1, 1}, {-0.1, 1, 1}, {-1, 1, 1}}, 2);
  CHECK(buffer.sees(frame, {1, 0, 2}, 3, plane_of_item));
  CHECK_FALSE(buffer.sees(frame, {-1, 0, 2}, 3, plane_of_item));
  CHECK(buffer.sees(frame, {-0.5, 0, 1}, 4, plane_of_item));
  CHECK(buffer.sees(frame, {-1e-4, 1, 2}, 3, plane_of_item));     // its pixel's centre may well lie on the neighbour
  CHECK_FALSE(buffer.sees(frame, {1, 0, -2}, 3, plane_of_item));  // behind
  CHECK_FALSE(buffer.sees(frame, {9, 0, 1}, 3, plane_of_item));   // nothing there
  CHECK(buffer.sees(frame, {1, 0, 2}, 1, {}));                    // items are planes
  HemicubeBitmap nearer(64);
  nearer.cover_run(0, pixel_count(64));
  buffer.clear(nearer);
  CHECK_FALSE(buffer.sees(frame, {1, 0, 2}, 3, plane_of_item));  // a nearer cell hides it
}

TEST_CASE("item_projector: in a closed room the centre sees all walls, and what stands in between hides") {
  Random random(5);
  const Box room{{0, 0, 0}, {4, 5, 3}};
  const auto corner = [&](int i) {
    return Vec3{i & 1 ? room.hi.x : room.lo.x, i & 2 ? room.hi.y : room.lo.y, i & 4 ? room.hi.z : room.lo.z};
  };
  constexpr int sides[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  std::uint32_t wrong = 0, tested = 0;
  for (int i = 0; i < 50; ++i) {
    const HemicubeFrame frame =
        random_frame(random, room.lo + (0.1 + 0.8 * Vec3{random.unit(), random.unit(), random.unit()}) * room.size());
    std::vector<Polygon> scene;
    for (const auto& side : sides)
      scene.push_back({corner(side[0]), corner(side[1]), corner(side[2]), corner(side[3])});
    for (int k = 0; k < 4; ++k)
      scene.push_back(random_polygon(random, frame.centre + 0.5 * random_unit(random), 0.2, 1.0));
    ItemBuffer buffer(256);
    std::vector<LocalPolygon> polygons;
    for (std::uint32_t k = 0; k < scene.size(); ++k)
      buffer.project(frame, scene[k], k), polygons.emplace_back(frame, scene[k]);
    for (int k = 0; k < 500; ++k) {
      const std::uint32_t wall = random.below(6);
      const Vec3 point = scene[wall][0] + random.unit() * (scene[wall][1] - scene[wall][0]) +
                         random.unit() * (scene[wall][3] - scene[wall][0]);
      const Vec3 local = frame.to_local(point - frame.centre);
      if (local.z < 0.02) continue;
      ++tested;
      wrong += buffer.sees(frame, point, wall, {}) != (nearest(polygons, local).item == wall);
    }
  }
  CHECK(tested > 5000);
  // The two answers differ where the sample and its pixel's centre lie on two sides of an edge: half a pixel along the
  // outlines, some 12 m of them.
  CHECK(wrong < tested / 50);
}
