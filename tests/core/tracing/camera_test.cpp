#include "core/tracing/camera.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

TEST_CASE("camera: the middle of the film looks at the target, its upper edge half the field of view higher") {
  const Camera camera{"", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 90};
  const PinholeCamera film(camera, 200, 100);
  const Vec3 middle = film.direction({100, 50}), top = film.direction({100, 0}), right = film.direction({200, 50});
  CHECK(glm::length(middle - Vec3{0, 1, 0}) < 1e-12);
  CHECK(top.z == doctest::Approx(std::sqrt(0.5)));
  CHECK(right.x / right.y == doctest::Approx(2.0));  // twice as wide as high
}

TEST_CASE("camera: an up that runs along the view is replaced, an impossible camera is refused") {
  const auto straight_down = checked({"", {0, 0, 5}, {0, 0, 0}, {0, 0, 1}, 60});
  REQUIRE(straight_down);
  CHECK(glm::length(glm::cross(straight_down->up, Vec3{0, 0, 1})) > 0.5);
  CHECK_FALSE(checked({"", {1, 2, 3}, {1, 2, 3}, {0, 0, 1}, 60}));
  CHECK_FALSE(checked({"", {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 180}));
  CHECK_FALSE(checked({"", {0, 0, 0}, {0, std::nan(""), 0}, {0, 0, 1}, 60}));
}

TEST_CASE("camera: an eye on a wall or inside one is refused, one in the room is not") {
  const PanelRoom room;
  const TraceScene scene(room.scene);
  Camera camera{"", {2, 2, 1.5}, {2, 4, 1.5}, {0, 0, 1}, 60};
  CHECK(standing_free(camera, scene));
  camera.eye = {2, 1e-7, 1.5};
  CHECK_FALSE(standing_free(camera, scene));

  auto with_body = std::make_shared<Scene>(*room.scene);
  add_box(*with_body, {1, 1, 1}, {1.002, 1.002, 1.002}, 0, false);
  camera.eye = {1.001, 1.001, 1.001};
  CHECK_FALSE(standing_free(camera, TraceScene(with_body)));
}

TEST_CASE("camera: left alone it frames the inside of a room") {
  const PanelRoom room;
  const TraceScene scene(room.scene);
  const Camera camera = framing_camera(scene, 4.0 / 3);
  CHECK(bounds(*room.scene).contains(camera.eye));
  CHECK(standing_free(camera, scene));
  const PinholeCamera film(camera, 64, 48);
  double far = 0;
  for (std::uint32_t i = 0; i < 64 * 48; ++i)
    if (const auto hit = scene.rays().nearest(camera.eye, film.direction({i % 64 + 0.5, i / 64 + 0.5})))
      far += hit->distance > 2.5;
  CHECK(far / (64 * 48) > 0.5);
}

TEST_CASE("camera: left alone it looks into a box through its open side") {
  auto open = std::make_shared<Scene>();
  const std::uint32_t grey = add_material(*open, diffuse(0.5));
  add_box(*open, {0, 0, 0}, {5, 5, 5}, grey, true);
  open->surfaces.erase(open->surfaces.begin() + 2);  // the face at y = 0
  const TraceScene scene(open);
  const Camera camera = framing_camera(scene, 1);
  CHECK(camera.eye.y < 0);
  CHECK(camera.eye.x == doctest::Approx(2.5));
}

TEST_CASE("camera: left alone it does not stand inside furniture") {
  PanelRoom room;
  add_box(*room.scene, {0.05, 0.05, 0}, {1.8, 1.8, 2.5}, 0, false);
  const Camera camera = framing_camera(TraceScene(room.scene), 1.5);
  CHECK_FALSE((camera.eye.x < 1.8 && camera.eye.y < 1.8 && camera.eye.x > 0));
}
