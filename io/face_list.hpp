/// The polygons of all parts of a scene, before they are surfaces: world coordinates, any shape, faults included.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

struct FaceList {
  /// What a face is in its file, beside its shape and material.
  struct Origin {
    std::uint32_t group = none;      ///< index into groups
    std::uint32_t counts_to = none;  ///< index of the face it is one with (`.vs3`: combined surfaces)
    bool only_obstructs = false;     ///< it has no view factors of its own (`.vs3`)
    static constexpr std::uint32_t none = 0xffffffffu;
  };
  struct Face {
    std::uint32_t first = 0, count = 0;  ///< range of corners
    std::uint32_t material = 0;          ///< index into Scene::materials
    std::uint32_t line = 0;
    std::uint16_t part = 0;  ///< index into parts
    bool textured = false;   ///< its texcoords mean something
    Origin origin;
  };
  std::vector<Vec3> corners;    ///< m, z up
  std::vector<Vec2> texcoords;  ///< one per corner
  std::vector<Face> faces;
  std::vector<std::string> parts;   ///< file names
  std::vector<std::string> groups;  ///< names of OBJ objects and groups, each once

  std::span<const Vec3> corners_of(const Face& face) const { return {corners.data() + face.first, face.count}; }
  /// The number of a group's name. @cost O(groups)
  std::uint32_t group(const std::string& name);
  /// "office.obj:123".
  std::string where(std::size_t face) const;
};

/// One number per point, equal for points in the same place.
/// @param tolerance  points that differ by less count as one, unless a rounding border falls between them
std::vector<std::uint32_t> welded(std::span<const Vec3> points, double tolerance);

/// Turns the faces into convex planar surfaces of the scene and counts in the report what it took:
/// faces without area, duplicates and crossing ones are dropped, bent ones (a corner off the plane by more than 1e-6 of
/// the size) become triangles, concave ones convex pieces. Of two duplicates one that emits is kept, else the first.
/// @param keep_backs  two faces back to back are none
/// @cost O(n log n) in the corners, plus O(k²) for a concave face of k ≤ 10 000 corners
Status make_surfaces(const FaceList& faces, Scene& scene, ImportReport& report, bool keep_backs = false);

}  // namespace lichthof::io
