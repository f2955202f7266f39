#include "core/tracing/contact_lines.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

TEST_CASE("contact_lines: a line separates what lies on its two sides, and only along its length") {
  const ContactLine line{{0, 0}, {2, 0}};
  CHECK(separates(line, {1, 1}, {1.5, -1}, 1e-9));
  CHECK_FALSE(separates(line, {1, 1}, {1.5, 0.5}, 1e-9));
  CHECK_FALSE(separates(line, {3, 1}, {3, -1}, 1e-9));
  // A centre on the line belongs to neither side, a point on the line to both.
  CHECK(separates(line, {1, 1}, {1.5, 1e-6}, 1e-3));
  CHECK_FALSE(separates(line, {1, 1e-6}, {1.5, -1}, 1e-3));
}

TEST_CASE("contact_lines: a line touches the rectangles it crosses") {
  const ContactLine line{{0, 0}, {4, 2}};
  CHECK(touches(line, {1, 0}, {3, 2}));
  CHECK(touches(line, {-1, -1}, {5, 5}));
  CHECK_FALSE(touches(line, {3, 0}, {4, 1}));
  CHECK_FALSE(touches(line, {5, 0}, {6, 9}));
}

TEST_CASE("contact_lines: what stands on a plane leaves a line, what hangs above, lies in it or is glass leaves none") {
  Scene scene;
  const std::uint32_t grey = add_material(scene, diffuse(0.5));
  add_rectangle(scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
  add_rectangle(scene, {1, 1, 0}, {0, 2, 0}, {0, 0, 1}, grey);
  add_rectangle(scene, {2, 1, 0.5}, {0, 2, 0}, {0, 0, 1}, grey);
  add_rectangle(scene, {3, 1, 0}, {0, 2, 0}, {0, 0, 1}, add_material(scene, glass(1.5)));
  const Plane floor{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<ContactLine> lines = contact_lines(scene, SurfaceBoxes(scene), floor, {0, 0}, {4, 4}, 0.01);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].a.x == doctest::Approx(1));
  CHECK(std::abs(lines[0].a.y - lines[0].b.y) == doctest::Approx(2));
}

TEST_CASE("contact_lines: the boxes give every surface that a box meets") {
  Scene scene;
  const std::uint32_t grey = add_material(scene, diffuse(0.5));
  for (int i = 0; i < 200; ++i) add_rectangle(scene, {0.1 * i, 0.05 * i, 0}, {0.3, 0, 0}, {0, 0.3, 0.2}, grey);
  Box box;
  box.include({5, 2.4, 0.1}), box.include({5.5, 3, 0.15});
  std::vector<std::uint32_t> expected;
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    Box own;
    for (const Vec3& corner : scene.surfaces[s].corners) own.include(corner);
    bool apart = false;
    for (int axis = 0; axis < 3; ++axis) apart |= own.lo[axis] > box.hi[axis] || own.hi[axis] < box.lo[axis];
    if (!apart) expected.push_back(s);
  }
  REQUIRE_FALSE(expected.empty());
  CHECK(SurfaceBoxes(scene).near(box) == expected);
}
