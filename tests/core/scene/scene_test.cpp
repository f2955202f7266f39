#include "core/scene/scene.hpp"

#include <doctest/doctest.h>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// Two by two texels: black and red above, green and blue below.
Texture four_texels() {
  Texture texture;
  texture.width = texture.height = 2;
  texture.rgb = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  return texture;
}

}  // namespace

TEST_SUITE("scene") {
  TEST_CASE("scene: a texture has its rows from the top, its v upwards, and repeats") {
    const Texture texture = four_texels();
    const auto near = [](const Rgb& a, const Rgb& b) { return glm::length(a - b) < 1e-6; };
    CHECK(near(texture.sample({0.25, 0.75}), {0, 0, 0}));
    CHECK(near(texture.sample({0.75, 0.75}), {1, 0, 0}));
    CHECK(near(texture.sample({0.25, 0.25}), {0, 1, 0}));
    CHECK(near(texture.sample({0.75, 0.25}), {0, 0, 1}));
    CHECK(near(texture.sample({0.5, 0.5}), {0.25, 0.25, 0.25}));
    for (const Vec2& shift : {Vec2{1, 0}, Vec2{0, 1}, Vec2{-1, -3}, Vec2{5, 2}})
      CHECK(near(texture.sample(Vec2{0.3, 0.6} + shift), texture.sample({0.3, 0.6})));
  }

  TEST_CASE("scene: texture coordinates are affine over a parallelogram") {
    Surface surface;
    surface.corners = {{1, 1, 1}, {3, 1, 1}, {3, 1, 4}, {1, 1, 4}};
    surface.texcoords = {{0, 0}, {2, 0}, {2, 3}, {0, 3}};
    for (const Vec2& p : {Vec2{0, 0}, Vec2{2, 3}, Vec2{0.5, 2.5}, Vec2{1.9, 0.1}}) {
      const Vec2 t = texcoord_at(surface, {1 + p.x, 1, 1 + p.y});
      CHECK(glm::length(t - p) < 1e-12);
    }
  }

  TEST_CASE("scene: a texture multiplies the reflectance of its material") {
    Scene scene;
    scene.textures.push_back(four_texels());
    Material material = test::diffuse(0.5);
    material.texture = 0;
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, material));
    scene.surfaces[0].texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    CHECK(glm::length(reflectance_at(scene, scene.surfaces[0], {0.75, 0.75, 0}) - Rgb{0.5, 0, 0}) < 1e-6);
    scene.surfaces[0].texcoords.clear();
    CHECK(reflectance_at(scene, scene.surfaces[0], {0.75, 0.75, 0}) == Rgb{0.5});
  }

  TEST_CASE("scene: file coordinates go to the world and back") {
    const FileFrame frame{0.001, true};
    CHECK(glm::length(frame.point_to_world({1000, 2000, 3000}) - Vec3{1, -3, 2}) < 1e-12);
    CHECK(glm::length(frame.point_to_file(frame.point_to_world({7, -8, 9})) - Vec3{7, -8, 9}) < 1e-9);
    CHECK(FileFrame{}.point_to_world({1, 2, 3}) == Vec3{1, 2, 3});
  }

  TEST_CASE("scene: the bounds hold every corner and touch the outermost") {
    const test::PanelRoom room;
    const Box box = bounds(*room.scene);
    CHECK(box.lo == Vec3{0, 0, 0});
    CHECK(box.hi == Vec3{4, 4, 3});
    CHECK(box.centre() == Vec3{2, 2, 1.5});
    CHECK(box.contains({4, 4, 3}));
    CHECK_FALSE(box.contains({4, 4, 3.1}));
    CHECK(box.contains({4, 4, 3.1}, 0.2));
  }
}
