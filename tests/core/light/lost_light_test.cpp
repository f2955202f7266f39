#include "core/light/lost_light.hpp"

#include <doctest/doctest.h>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// A closed room, 4 x 3 x 2.5 m times a scale, and a lamp of .6 x .6 m.
struct RoomWithLamp {
  double scale = 1;
  Scene scene;
  explicit RoomWithLamp(double scale_) : scale(scale_) {
    test::add_box(scene, {0, 0, 0}, scale * Vec3{4, 3, 2.5}, test::add_material(scene, test::diffuse(0.6)), true);
  }
  void lamp_at(double z, bool up) {
    const std::uint32_t lamp = test::add_material(scene, test::luminous(100));
    const Vec3 x{0.6 * scale, 0, 0}, y{0, 0.6 * scale, 0};
    test::add_rectangle(scene, scale * Vec3{1.7, 1.2, z}, up ? x : y, up ? y : x, lamp);
  }
  std::vector<LostLight> lost() const {
    const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
    return lost_light(scene, rays, Parallel(1));
  }
};

}  // namespace

TEST_SUITE("lost_light") {
  TEST_CASE("lost_light: a lamp above the roof that looks up loses all its light, in any unit") {
    for (const double scale : {0.001, 1.0, 1000.0}) {
      RoomWithLamp room(scale);
      room.lamp_at(2.51, true);
      const auto lost = room.lost();
      REQUIRE(lost.size() == 1);
      CHECK(lost[0].surface == 6);
      CHECK(lost[0].where == LostLight::Where::out_of_scene);
    }
  }

  TEST_CASE("lost_light: a lamp at the ceiling that looks into it") {
    for (const double scale : {0.001, 1.0, 1000.0}) {
      RoomWithLamp room(scale);
      room.lamp_at(2.499, true);
      const auto lost = room.lost();
      REQUIRE(lost.size() == 1);
      CHECK(lost[0].where == LostLight::Where::into_support);
    }
  }

  TEST_CASE("lost_light: a lamp cut out of the ceiling that looks up") {
    RoomWithLamp room(1);
    Scene& scene = room.scene;
    scene.surfaces.erase(scene.surfaces.begin() + 5);  // +z: four pieces around the lamp take its place
    const std::uint32_t grey = 0;
    test::add_rectangle(scene, {0, 0, 2.5}, {0, 3, 0}, {1.7, 0, 0}, grey);
    test::add_rectangle(scene, {2.3, 0, 2.5}, {0, 3, 0}, {1.7, 0, 0}, grey);
    test::add_rectangle(scene, {1.7, 0, 2.5}, {0, 1.2, 0}, {0.6, 0, 0}, grey);
    test::add_rectangle(scene, {1.7, 1.8, 2.5}, {0, 1.2, 0}, {0.6, 0, 0}, grey);
    room.lamp_at(2.5, true);
    const auto lost = room.lost();
    REQUIRE(lost.size() == 1);
    CHECK(lost[0].where == LostLight::Where::into_support);
  }

  TEST_CASE("lost_light: an uplight, a lamp on the ceiling and a far sun are not lost") {
    RoomWithLamp uplight(1), ceiling(1), outside(1);
    uplight.lamp_at(2.45, true);
    CHECK(uplight.lost().empty());
    ceiling.lamp_at(2.499, false);
    CHECK(ceiling.lost().empty());
    // A sun of 4.6 m radius at 1 km: hardly one of its own rays in 100 000 meets the room.
    const std::uint32_t sun = test::add_material(outside.scene, test::luminous(1e7));
    test::add_rectangle(outside.scene, {-2, -3, 1000}, {0, 9, 0}, {9, 0, 0}, sun);
    CHECK(outside.lost().empty());
  }
}
