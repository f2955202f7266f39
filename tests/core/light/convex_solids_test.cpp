#include "core/light/convex_solids.hpp"

#include <doctest/doctest.h>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

constexpr double tolerance = 1e-9;

Scene with_box(bool inwards, bool open) {
  Scene scene;
  test::add_material(scene, test::diffuse(0.5));
  test::add_box(scene, {1, 1, 0}, {2, 2, 1}, 0, inwards);
  if (open) std::erase_if(scene.surfaces, [](const Surface& s) { return s.corners[0].z + s.corners[2].z == 0; });
  return scene;
}

bool outside(const ConvexSolid& solid, const Polygon& corners) {
  return is_outside(solid, 1000, corners, glm::normalize(newell_vector(corners)), tolerance);
}

}  // namespace

TEST_SUITE("convex_solids") {
  TEST_CASE("convex_solids: a box is one, looking out or in, and with a face missing, too") {
    for (const bool inwards : {false, true})
      for (const bool open : {false, true}) {
        const Scene scene = with_box(inwards, open);
        CAPTURE(inwards);
        CAPTURE(open);
        const std::vector<ConvexSolid> solids = convex_solids(scene.surfaces, tolerance);
        REQUIRE(solids.size() == 1);
        CHECK(solids[0].surfaces.size() == (open ? 5 : 6));
        CHECK(solids[0].shape.planes.size() == 6);
        CHECK(solids[0].shape.rims.size() == 12);
        for (const Obstruction::Plane& plane : solids[0].shape.planes) CHECK(plane.height({1.5, 1.5, 0.5}) < 0);
        std::vector<Vec3> sides;
        // Seen from a corner's direction three faces make a silhouette of six edges, from before a face four.
        CHECK(shadow_sides(solids[0].shape, {5, 5, 5}, tolerance, sides));
        CHECK(sides.size() == 6);
        CHECK(shadow_sides(solids[0].shape, {1.5, 1.5, 5}, tolerance, sides));
        CHECK(sides.size() == 4);
        for (const Vec3& side : sides) CHECK(glm::dot(side, Vec3{1.5, 1.5, 0.5} - Vec3{1.5, 1.5, 5}) > 0);
        CHECK_FALSE(shadow_sides(solids[0].shape, {1.5, 1.5, 0.5}, tolerance, sides));
      }
  }

  TEST_CASE("convex_solids: what is bent inwards, has two faces missing or hangs on a third face by an edge is none") {
    Scene scene = with_box(false, false);
    scene.surfaces[0].corners[0] += 0.1 * scene.surfaces[0].normal;  // no longer the others' corner
    CHECK(convex_solids(scene.surfaces, tolerance).empty());
    scene = with_box(false, true);
    scene.surfaces.pop_back();
    CHECK(convex_solids(scene.surfaces, tolerance).empty());
    scene = with_box(false, false);
    test::add_polygon(scene, {{1, 1, 1}, {2, 1, 1}, {1.5, 1, 3}}, 0);
    CHECK(convex_solids(scene.surfaces, tolerance).empty());
    scene.surfaces.clear();
    test::add_polygon(scene, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, 0);
    test::add_polygon(scene, {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}}, 0);
    CHECK(convex_solids(scene.surfaces, tolerance).empty());
  }

  TEST_CASE("convex_solids: outside is what sees none of the inside, though it may touch") {
    const Scene scene = with_box(false, false);
    const ConvexSolid solid = convex_solids(scene.surfaces, tolerance).at(0);
    for (std::uint32_t i = 0; i < 6; ++i) {
      const Surface& face = scene.surfaces[i];
      CHECK(is_outside(solid, i, face.corners, face.normal, tolerance));
      CHECK_FALSE(is_outside(solid, i, face.corners, -face.normal, tolerance));
    }
    CHECK(outside(solid, {{0, 0, 2}, {3, 0, 2}, {3, 3, 2}}));
    CHECK(outside(solid, {{2, 0, 0}, {5, 0, 0}, {5, 5, 0}, {2, 5, 0}}));        // floor beside it
    CHECK_FALSE(outside(solid, {{0, 0, 0}, {5, 0, 0}, {5, 5, 0}, {0, 5, 0}}));  // floor under it
    CHECK_FALSE(outside(solid, {{1.2, 1.2, 0.5}, {1.8, 1.2, 0.5}, {1.5, 1.8, 0.5}}));
  }
}
