/// Scenes for the tests of the second pass: rooms of rectangles, panels, and solutions written down by hand.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "core/light/solution.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::test {

inline Material diffuse(double reflectance) {
  Material material;
  material.reflectance = Rgb{reflectance};
  return material;
}

inline Material luminous(double radiance, double reflectance = 0) {
  Material material = diffuse(reflectance);
  material.radiance = Rgb{radiance};
  return material;
}

inline Material specular(Finish finish, double share, double reflectance = 0, double exponent = 0) {
  Material material = diffuse(reflectance);
  material.finish = finish;
  material.specular = Rgb{share};
  material.exponent = exponent;
  return material;
}

inline Material glass(double refractive_index) {
  Material material = diffuse(0);
  material.finish = Finish::glass;
  material.refractive_index = refractive_index;
  return material;
}

inline std::uint32_t add_material(Scene& scene, const Material& material) {
  scene.materials.push_back(material);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

/// @returns number of the surface; its front is where the corners run counter-clockwise
inline std::uint32_t add_polygon(Scene& scene, Polygon corners, std::uint32_t material) {
  Surface surface;
  surface.normal = glm::normalize(newell_vector(corners));
  surface.area = area(corners);
  surface.corners = std::move(corners);
  surface.material = material;
  scene.surfaces.push_back(surface);
  return static_cast<std::uint32_t>(scene.surfaces.size() - 1);
}

/// Rectangle from a corner along two edges; front = cross(u, v).
inline std::uint32_t add_rectangle(Scene& scene, const Vec3& corner, const Vec3& u, const Vec3& v,
                                   std::uint32_t material) {
  return add_polygon(scene, {corner, corner + u, corner + u + v, corner + v}, material);
}

/// Six faces of a box, in the order -x +x -y +y -z +z. Fronts look inwards (a room) or outwards (a body).
inline void add_box(Scene& scene, const Vec3& lo, const Vec3& hi, std::uint32_t material, bool inwards) {
  const Vec3 x{hi.x - lo.x, 0, 0}, y{0, hi.y - lo.y, 0}, z{0, 0, hi.z - lo.z};
  const auto face = [&](const Vec3& corner, const Vec3& u, const Vec3& v) {
    if (inwards)
      add_rectangle(scene, corner, u, v, material);
    else
      add_rectangle(scene, corner, v, u, material);
  };
  face(lo, y, z), face(lo + x, z, y);
  face(lo, z, x), face(lo + y, x, z);
  face(lo, x, y), face(lo + z, y, x);
}

/// Values per element from a function of the world point at its centre.
inline std::vector<Rgb> values_on(const Mesh& mesh, const std::function<Rgb(const Vec3&)>& function) {
  std::vector<Rgb> values(mesh.elements.size());
  for (const Patch& patch : mesh.patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      values[e] = function(mesh.planes[patch.plane.value].point(mesh.elements[e].centre));
  return values;
}

/// A solution with given irradiance everywhere: total, and the direct part of it.
inline Solution uniform_solution(std::shared_ptr<const Scene> scene, double element_size, double total, double direct) {
  Solution solution;
  solution.scene = scene;
  MeshOptions options;
  options.element_size = element_size;
  solution.mesh = std::make_shared<Mesh>(mesh_of(*scene, options, {}));
  solution.irradiance.assign(solution.mesh->elements.size(), Rgbf{static_cast<float>(total)});
  solution.direct_irradiance.assign(solution.mesh->elements.size(), Rgbf{static_cast<float>(direct)});
  solution.pending.assign(solution.mesh->elements.size(), Rgbf{0.f});
  solution.shot.assign(solution.mesh->elements.size(), Rgbf{0.f});
  return solution;
}

/// A closed cube whose walls all emit and reflect alike: irradiance π Ke/(1 - ρ) everywhere, of which π Ke comes straight.
struct Furnace {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  double radiance, reflectance;
  Furnace(double radiance_, double reflectance_) : radiance(radiance_), reflectance(reflectance_) {
    add_box(*scene, {0, 0, 0}, {1, 1, 1}, add_material(*scene, luminous(radiance, reflectance)), true);
  }
  double total() const { return std::numbers::pi * radiance / (1 - reflectance); }
  double direct() const { return std::numbers::pi * radiance; }
  Solution solution(double element_size = 0.1) const {
    return uniform_solution(scene, element_size, total(), direct());
  }
};

/// CIE 171:2006 5.3: black room 4 x 4 x 3 m, ceiling panel 1 x 1 m in its middle; here the panel's radiance is 1000, so
/// that irradiances carry the numbers of the report's illuminances.
struct PanelRoom {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  explicit PanelRoom(double reflectance = 0) {
    const std::uint32_t wall = add_material(*scene, diffuse(reflectance)), panel = add_material(*scene, luminous(1000));
    add_box(*scene, {0, 0, 0}, {4, 4, 3}, wall, true);
    scene->surfaces.pop_back();  // the ceiling, again around the panel
    const auto strip = [&](double x0, double y0, double x1, double y1, std::uint32_t material) {
      add_polygon(*scene, {{x0, y0, 3}, {x0, y1, 3}, {x1, y1, 3}, {x1, y0, 3}}, material);
    };
    strip(0, 0, 4, 1.5, wall), strip(0, 2.5, 4, 4, wall), strip(0, 1.5, 1.5, 2.5, wall), strip(2.5, 1.5, 4, 2.5, wall);
    strip(1.5, 1.5, 2.5, 2.5, panel);
  }
};

}  // namespace lichthof::test
