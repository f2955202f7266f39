#include "core/tracing/trace_scene.hpp"

#include <doctest/doctest.h>

#include "core/tracing/scattering.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {
/// A single pane at x = 1 and a glass block from x = 2 to x = 3 inside a room.
std::shared_ptr<Scene> glass_room() {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {4, 4, 4}, add_material(*scene, diffuse(0.5)), true);
  const std::uint32_t clear = add_material(*scene, glass(1.5));
  add_rectangle(*scene, {1, 0.5, 0.5}, {0, 3, 0}, {0, 0, 3}, clear);
  add_box(*scene, {2, 1, 1}, {3, 3, 3}, clear, false);
  return scene;
}
}  // namespace

TEST_CASE("trace_scene: glass that closes a volume is solid, any other is a pane") {
  const TraceScene scene(glass_room());
  CHECK_FALSE(scene.is_solid_glass(6));
  for (std::uint32_t s = 7; s < 13; ++s) CHECK(scene.is_solid_glass(s));
}

TEST_CASE("trace_scene: light through glass is weakened by each face it crosses") {
  const TraceScene scene(glass_room());
  CHECK_FALSE(scene.clear_rays().occluded({0.5, 2, 2}, {3.5, 2, 2}));
  CHECK(scene.rays().occluded({0.5, 2, 2}, {3.5, 2, 2}));
  CHECK(scene.transmittance({0.5, 2, 2}, {1.5, 2, 2}) == doctest::Approx(1 - pane_reflectance(1, 1.5)));
  CHECK(scene.transmittance({1.5, 2, 2}, {3.5, 2, 2}) == doctest::Approx(0.96 * 0.96));
  CHECK(scene.transmittance({1.5, 2, 2}, {3.5, 2, 2}, true) == 0.0);
  CHECK(scene.transmittance({0.5, 3.8, 2}, {3.5, 3.8, 2}) == 1.0);
}

TEST_CASE("trace_scene: a ray's end lies on the surface's plane, its normal looks back") {
  const PanelRoom room;
  const TraceScene scene(room.scene);
  const auto down = scene.nearest({1.1, 1.7, 1.3}, {0.1, 0.2, -1});
  REQUIRE(down);
  CHECK(down->point.z == 0.0);
  CHECK(down->normal.z == 1.0);
  CHECK_FALSE(down->back);
  const auto outside = scene.nearest({2, 2, -1}, {0, 0, 1});
  REQUIRE(outside);
  CHECK(outside->back);
  CHECK(outside->normal.z == -1.0);
}

TEST_CASE("trace_scene: a sensor point finds the surface it lies on, on its own side only") {
  const PanelRoom room;
  const TraceScene scene(room.scene);
  CHECK(scene.surface_below({2, 2, 1e-6}, {0, 0, 1}, 1e-4));
  CHECK(scene.surface_below({2, 2, -1e-6}, {0, 0, 1}, 1e-4));
  CHECK_FALSE(scene.surface_below({2, 2, 0.5}, {0, 0, 1}, 1e-4));
  CHECK_FALSE(scene.surface_below({2, 2, 1e-6}, {1, 0, 0}, 1e-4));
}

TEST_CASE("trace_scene: a pane shows the front of a luminaire by its share, and nothing else") {
  auto scene = glass_room();
  add_rectangle(*scene, {0.2, 1, 1}, {0, 1, 0}, {0, 0, 1},
                add_material(*scene, luminous(7)));  // shines towards the pane
  const TraceScene trace(scene);
  const SurfacePoint on_pane =
      trace.surface_point(6, glm::dot(scene->surfaces[6].normal, Vec3{-1, 0, 0}) > 0, {1, 1.5, 1.5});
  REQUIRE(on_pane.normal.x < -0.999);
  std::uint64_t rays = 0;
  const Vec3 slanting = glm::normalize(Vec3{1, 0.2, 0});
  CHECK(trace.luminaire_in_glass(on_pane, slanting, rays).x ==
        doctest::Approx(7 * pane_reflectance(slanting.x, 1.5)).epsilon(1e-12));
  CHECK(trace.luminaire_in_glass(on_pane, glm::normalize(Vec3{1, 2, 0}), rays).x == 0);
  CHECK(rays == 2);
  const SurfacePoint behind =
      trace.surface_point(6, glm::dot(scene->surfaces[6].normal, Vec3{1, 0, 0}) > 0, {1, 1.5, 1.5});
  CHECK(trace.luminaire_in_glass(behind, {-1, 0, 0}, rays).x == 0);
}
