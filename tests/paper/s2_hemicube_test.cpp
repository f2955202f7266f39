/// What §2 says about the hemicube and the hemicube bitmap: scene, steps, expectation.
#include <doctest/doctest.h>

#include "core/light/bit_projector.hpp"
#include "core/light/hemicube_bitmap.hpp"
#include "core/light/item_projector.hpp"
#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;
using reference::LocalPolygon;
using reference::random_frame;
using reference::random_polygon;
using reference::random_unit;

namespace {

/// An upright rectangle over the segment from (x0, y0) to (x1, y1) of the plan, as high as it is deep.
Polygon upright(double x0, double y0, double x1, double y1, double half_height) {
  return {{x0, y0, -half_height}, {x1, y1, -half_height}, {x1, y1, half_height}, {x0, y0, half_height}};
}

/// The share of a polygon's points (of its first and second edge) that the bitmap leaves visible.
double visible_share(const HemicubeFrame& frame, const HemicubeBitmap& bitmap, const Polygon& polygon) {
  double sum = 0;
  constexpr int n = 20;
  for (int i = 0; i < n * n; ++i) {
    const double u = (i % n + 0.5) / n, v = (i / n + 0.5) / n;
    const Vec3 point = polygon[0] + u * (polygon[1] - polygon[0]) + v * (polygon[3] - polygon[0]);
    sum += bitmap.visibility(frame.to_local(point - frame.centre));
  }
  return sum / (n * n);
}

/// Small polygons at random places of a box.
std::vector<Polygon> clutter(Random& random, const Box& box, int count) {
  std::vector<Polygon> polygons;
  for (int i = 0; i < count; ++i) {
    const Vec3 share{random.unit(), random.unit(), random.unit()};
    polygons.push_back(random_polygon(random, box.lo + (0.2 + 0.6 * share) * box.size(), 0.2 * box.size().x, 1.0));
  }
  return polygons;
}

}  // namespace

TEST_SUITE_BEGIN("paper §2");

TEST_CASE("[Cohen85]: delta form factors sum to one") {
  double sum = 0;
  for (std::uint32_t pixel = 0; pixel < pixel_count(128); ++pixel) sum += delta_form_factor(pixel, 128);
  CHECK(sum == doctest::Approx(1.00003).epsilon(5e-6));
}

TEST_CASE("§2 Fig. 2: a bit is 1 exactly where a patch has been projected onto that pixel") {
  Random random(1);
  const HemicubeFrame frame = random_frame(random, {1, 1, 1});
  const std::vector<Polygon> patches = clutter(random, {{0, 0, 0}, {2, 2, 2}}, 12);

  HemicubeBitmap bitmap(64);
  for (const Polygon& patch : patches) project(frame, patch, bitmap);

  std::uint32_t wrong = 0;
  for (std::uint32_t pixel = 0; pixel < pixel_count(64); ++pixel) {
    bool met = false, undecided = false;
    for (const Polygon& patch : patches) {
      const LocalPolygon::Meeting meeting = LocalPolygon(frame, patch).meeting(pixel_direction(pixel, 64));
      met |= meeting.inside, undecided |= meeting.undecided;
    }
    wrong += !undecided && met != bitmap.covered(pixel);
  }
  CHECK(bitmap.covered_count() > 500);
  CHECK(wrong == 0);
}

TEST_CASE("§2: one bit per hemicube pixel is passed between the cells, and less on the wire") {
  Random random(2);
  const HemicubeFrame frame = random_frame(random, {1, 1, 1});

  HemicubeBitmap bitmap(128);
  for (const Polygon& patch : clutter(random, {{0, 0, 0}, {2, 2, 2}}, 30)) project(frame, patch, bitmap);

  CHECK(8 * bitmap.words().size() == 6144);
  CHECK(packed(bitmap).size() < 6144 / 4);
}

TEST_CASE("§2: projections are only performed on pixels with the bitmap entry 0") {
  Random random(3);
  const HemicubeFrame frame = random_frame(random, {0, 0, 0});
  HemicubeBitmap incoming(64);
  project(frame, random_polygon(random, frame.centre + 1.0 * frame.normal, 0.8, 1.0), incoming);

  // The patch lies nearer than whatever made the bitmap: only the bitmap can keep it out.
  ItemBuffer buffer(64);
  buffer.clear(incoming);
  const Polygon patch = random_polygon(random, frame.centre + 0.1 * frame.normal, 5.0, 1.0);
  buffer.project(frame, patch, 0);

  for (std::uint32_t pixel = 0; pixel < pixel_count(64); ++pixel) {
    if (incoming.covered(pixel)) REQUIRE(buffer.item(pixel) == ItemBuffer::nearer_cell);
  }
}

TEST_CASE("§2: the bitmap is updated while the projections are being performed") {
  Random random(4);
  const HemicubeFrame frame = random_frame(random, {1, 1, 1});
  HemicubeBitmap incoming(64), outgoing(64);
  project(frame, random_polygon(random, frame.centre + frame.normal, 0.8, 1.0), incoming);

  ItemBuffer buffer(64);
  buffer.clear(incoming);
  HemicubeBitmap expected = incoming;
  std::uint32_t item = 0;
  for (const Polygon& patch : clutter(random, {{0, 0, 0}, {2, 2, 2}}, 10)) {
    buffer.project(frame, patch, item++);
    project(frame, patch, expected);
  }
  buffer.cover(outgoing);

  CHECK(outgoing == expected);
}

TEST_CASE("§2 Fig. 3: the bitmaps of cells 1 and 4 joined by or hide patch b, a wrong order lights it") {
  // Plan:  cell 1 | cell 2     Shooter s in cell 3, patch a in cell 1, b in cell 2, c in cell 4.
  //        cell 3 | cell 4     Seen from s, a and c together cover b, neither does alone.
  HemicubeFrame s;
  s.centre = {0.5, 0.5, 0};
  s.normal = glm::normalize(Vec3{1, 1, 0});
  complete_frame(s.normal, s.tangent, s.bitangent);
  const Polygon a = upright(0.5, 1.3, 1.0, 1.0, 0.8), c = upright(1.0, 1.0, 1.3, 0.5, 0.8);
  const Polygon b = upright(1.2, 1.8, 1.8, 1.2, 0.3);
  const Box box_of_b{{1.2, 1.2, -0.3}, {1.8, 1.8, 0.3}};

  // Right: 3 to 1 and 3 to 4, each projects on its own, cell 2 joins.
  HemicubeBitmap from_1(128), from_4(128);
  project(s, a, from_1);
  project(s, c, from_4);
  HemicubeBitmap at_2 = from_1;
  at_2.merge(from_4);
  // Wrong: 3 to 1 to 2 to 4; b is projected before c.
  HemicubeBitmap wrong_at_4 = from_1;
  project(s, b, wrong_at_4);

  CHECK(visible_share(s, at_2, b) == 0.0);
  CHECK(at_2.covers(s, box_of_b));
  CHECK(visible_share(s, from_1, b) > 0.3);  // in the wrong order cell 2 knows nothing of c
  CHECK_FALSE(from_1.covers(s, box_of_b));
  CHECK(visible_share(s, HemicubeBitmap(128), c) == doctest::Approx(1.0));
  CHECK(visible_share(s, wrong_at_4, c) < 0.95);  // and b takes light from c, though it lies behind
}

TEST_CASE("§2 Fig. 4: three bitmaps of a 3-d topology join in any order") {
  Random random(5);
  const HemicubeFrame frame = random_frame(random, {1, 1, 1});
  HemicubeBitmap path[3] = {HemicubeBitmap(64), HemicubeBitmap(64), HemicubeBitmap(64)};
  HemicubeBitmap all(64);
  for (HemicubeBitmap& bitmap : path) {
    for (const Polygon& patch : clutter(random, {{0, 0, 0}, {2, 2, 2}}, 5))
      project(frame, patch, bitmap), project(frame, patch, all);
  }

  const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& order : orders) {
    HemicubeBitmap joined(64);
    for (const int k : order) joined.merge(path[k]);
    CHECK(joined == all);
  }
}

TEST_CASE("§2: no depth values are needed between cells: bits of the nearer cell give the same picture") {
  // Two cells side by side and a shooter in the first: at every pixel the two-cell scheme must see the same patch as
  // one item buffer with depth over both cells.
  Random random(6);
  const Box near_cell{{0, 0, 0}, {2, 2, 2}}, far_cell{{2, 0, 0}, {4, 2, 2}};
  for (int i = 0; i < 30; ++i) {
    const HemicubeFrame frame = random_frame(random, {0.2, 1, 1});
    const std::vector<Polygon> near_patches = clutter(random, near_cell, 8), far_patches = clutter(random, far_cell, 8);

    ItemBuffer together(64), near(64), far(64);
    HemicubeBitmap message(64);
    std::uint32_t item = 0;
    for (const Polygon& patch : near_patches) {
      together.project(frame, patch, item), near.project(frame, patch, item), project(frame, patch, message);
      ++item;
    }
    far.clear(message);
    for (const Polygon& patch : far_patches) {
      together.project(frame, patch, item), far.project(frame, patch, item);
      ++item;
    }

    std::uint32_t wrong = 0;
    for (std::uint32_t pixel = 0; pixel < pixel_count(64); ++pixel) {
      const std::uint32_t seen = message.covered(pixel) ? near.item(pixel) : far.item(pixel);
      wrong += seen != together.item(pixel);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("§2 [Baum89]: a sample point is visible when its hemicube pixel holds its own patch, within half a pixel") {
  // A wall behind a screen: the share of wrongly judged samples is the silhouette's length times the pixel width.
  const HemicubeFrame s{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Polygon wall{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  const Polygon screen{{-0.2, -0.21, 0.5}, {0.23, -0.11, 0.5}, {0.17, 0.26, 0.5}, {-0.13, 0.19, 0.5}};
  const LocalPolygon local_screen(s, screen);
  Random random(7);

  double share_before = 1;
  for (const std::uint32_t resolution : {16u, 64u, 256u}) {
    ItemBuffer buffer(resolution);
    buffer.project(s, wall, 0);
    buffer.project(s, screen, 1);
    std::uint32_t wrong = 0;
    constexpr std::uint32_t samples = 40000;
    for (std::uint32_t i = 0; i < samples; ++i) {
      const Vec3 point{2 * random.unit() - 1, 2 * random.unit() - 1, 1};
      wrong += buffer.sees(s, point, 0, {}) == local_screen.meeting(point).inside;
    }
    const double share = static_cast<double>(wrong) / samples;
    // The silhouette is 3 m long on the wall of 4 m²; a band of half a pixel along it may be judged wrongly.
    CHECK(share < 3.0 / 4.0 * 0.5 * (2.0 / resolution));
    CHECK(share < 0.5 * share_before);
    share_before = share;
  }
}

TEST_SUITE_END();
