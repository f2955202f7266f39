/// A small scene for the real light: two rooms of 4 x 4 x 2.5 m with a door between them, a lamp and a table in each. The
/// wall stands on a line of the grid, so two cells may meet in it.
#pragma once

#include <memory>

#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::test {

inline void add_quad(Scene& scene, const Vec3& corner, const Vec3& u, const Vec3& v, std::uint32_t material) {
  Surface surface;
  surface.corners = {corner, corner + u, corner + u + v, corner + v};
  const Vec3 n = glm::cross(u, v);
  surface.area = glm::length(n);
  surface.normal = n / surface.area;
  surface.material = material;
  scene.surfaces.push_back(surface);
}

/// @param has_door  false: a closed wall, no light passes
inline std::shared_ptr<const Scene> two_rooms(bool has_door = true) {
  auto scene = std::make_shared<Scene>();
  const auto material = [&](const Rgb& reflectance, const Rgb& radiance) {
    Material m;
    m.reflectance = reflectance;
    m.radiance = radiance;
    scene->materials.push_back(m);
    return static_cast<std::uint32_t>(scene->materials.size() - 1);
  };
  const std::uint32_t white = material(Rgb{0.7, 0.7, 0.7}, Rgb{0.0}), red = material(Rgb{0.6, 0.2, 0.1}, Rgb{0.0});
  const std::uint32_t lamp = material(Rgb{0.5, 0.5, 0.5}, Rgb{10, 9, 8}),
                      dim = material(Rgb{0.5, 0.5, 0.5}, Rgb{2, 2, 3});
  const double length = 8, width = 4, height = 2.5;
  add_quad(*scene, {0, 0, 0}, {length, 0, 0}, {0, width, 0}, white);
  add_quad(*scene, {0, width, height}, {length, 0, 0}, {0, -width, 0}, white);
  add_quad(*scene, {0, 0, 0}, {0, width, 0}, {0, 0, height}, red);
  add_quad(*scene, {length, width, 0}, {0, -width, 0}, {0, 0, height}, white);
  add_quad(*scene, {length, 0, 0}, {-length, 0, 0}, {0, 0, height}, white);
  add_quad(*scene, {0, width, 0}, {length, 0, 0}, {0, 0, height}, white);
  if (has_door) {
    add_quad(*scene, {4, 0, 0}, {0, 1.5, 0}, {0, 0, height}, red);
    add_quad(*scene, {4, 2.5, 0}, {0, 1.5, 0}, {0, 0, height}, red);
    add_quad(*scene, {4, 1.5, 2}, {0, 1, 0}, {0, 0, height - 2}, red);
  } else {
    add_quad(*scene, {4, 0, 0}, {0, width, 0}, {0, 0, height}, red);
  }
  add_quad(*scene, {1.5, 2.5, height - 0.1}, {1, 0, 0}, {0, -1, 0}, lamp);
  add_quad(*scene, {6, 1.5, height - 0.1}, {0.5, 0, 0}, {0, -0.5, 0}, dim);
  add_quad(*scene, {2.5, 0.5, 0.8}, {1, 0, 0}, {0, 1, 0}, white);
  add_quad(*scene, {5, 2.2, 0.8}, {1.2, 0, 0}, {0, 1, 0}, red);
  return scene;
}

}  // namespace lichthof::test
