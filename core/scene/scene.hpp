/// What is lit: surfaces, materials, textures, cameras. The immutable input of a run, in metres and z up.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/types.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof {

/// How the second pass treats a surface. The first pass sees the diffuse reflectance alone.
enum class Finish : std::uint8_t {
  diffuse,  ///< Kd only
  glossy,   ///< Kd plus a Phong lobe Ks, Ns (energy normalised)
  mirror,   ///< illum 3: ideal specular reflection by Ks
  glass,    ///< illum 4..7: Fresnel reflection and refraction with Ni; lets light pass
};

struct Texture {
  std::string name;
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;  ///< linear, row by row from the top, 3 floats a texel
  /// Bilinear look-up, repeating; v points up as in OBJ.
  Rgb sample(const Vec2& texcoord) const;
};

struct Material {
  std::string name;
  Rgb reflectance{0.5};       ///< Kd, each channel in [0, 1)
  Rgb radiance{0.0};          ///< Ke, W/(m² sr), leaves the front only
  Rgb specular{0.0};          ///< Ks
  double exponent = 0.0;      ///< Ns
  double refractive_index = 1.5;
  Finish finish = Finish::diffuse;
  std::optional<std::uint32_t> texture;  ///< map_Kd; multiplies `reflectance`
  bool emits() const { return radiance.x > 0 || radiance.y > 0 || radiance.z > 0; }
};

/// One planar convex polygon. The front is where its corners run counter-clockwise; both sides reflect.
struct Surface {
  Polygon corners;               ///< ≥ 3, convex, planar within 1e-6 of its size
  std::vector<Vec2> texcoords;   ///< one per corner, or none
  Vec3 normal{0, 0, 1};          ///< unit, of the front
  double area = 0;               ///< m²
  std::uint32_t material = 0;    ///< index into Scene::materials
  std::uint32_t source_face = 0; ///< number of the face in the input file, from 1; pieces of one face share it
};

struct Camera {
  std::string name;
  Vec3 eye{0.0}, target{0, 1, 0}, up{0, 0, 1};
  double vertical_fov_deg = 60;
};

/// The coordinates users write: the scene file's own unit and up axis.
struct FileFrame {
  double metres_per_unit = 1.0;
  bool y_up = false;
  Vec3 point_to_world(const Vec3& p) const { return metres_per_unit * direction_to_world(p); }
  Vec3 direction_to_world(const Vec3& d) const { return y_up ? Vec3{d.x, -d.z, d.y} : d; }
  Vec3 point_to_file(const Vec3& p) const {
    const Vec3 q = p / metres_per_unit;
    return y_up ? Vec3{q.x, q.z, -q.y} : q;
  }
};

struct Scene {
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Surface> surfaces;
  std::vector<Camera> cameras;        ///< the first is the default
  FileFrame file_frame;
  std::optional<double> patch_size;   ///< m; what the scene file asks of the mesher
  std::optional<double> element_size; ///< m; likewise

  const Material& material_of(const Surface& surface) const { return materials[surface.material]; }
};

struct Box {
  Vec3 lo{1e300}, hi{-1e300};
  void include(const Vec3& p) { lo = glm::min(lo, p), hi = glm::max(hi, p); }
  Vec3 size() const { return hi - lo; }
  Vec3 centre() const { return 0.5 * (lo + hi); }
  bool contains(const Vec3& p, double margin = 0) const {
    return p.x >= lo.x - margin && p.y >= lo.y - margin && p.z >= lo.z - margin && p.x <= hi.x + margin &&
           p.y <= hi.y + margin && p.z <= hi.z + margin;
  }
};

/// Smallest box around all surfaces. @pre at least one surface
Box bounds(const Scene& scene);

/// Point of a surface, uniform by area, for a point of the unit square.
Vec3 point_of(const Surface& surface, const Vec2& square);

/// Texture coordinate at a point of a surface: barycentric over the fan of triangles from corner 0.
/// @pre the surface has texture coordinates
Vec2 texcoord_at(const Surface& surface, const Vec3& point);

/// Diffuse reflectance at a point of the surface, texture included.
Rgb reflectance_at(const Scene& scene, const Surface& surface, const Vec3& point);

}  // namespace lichthof
