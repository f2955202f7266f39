#include "core/light/bit_projector.hpp"

#include <algorithm>
#include <glm/common.hpp>

#include "core/light/polygon_scan.hpp"

namespace lichthof {

void project(const HemicubeFrame& frame, std::span<const Vec3> corners, HemicubeBitmap& bitmap) {
  const std::uint32_t resolution = bitmap.resolution();
  for_each_piece(corners, [&](std::span<const Vec3> piece) {
    PolygonScan scan;
    if (!scan.set_polygon(frame, piece)) return;
    for (std::uint32_t face = 0; face < face_count; ++face) {
      if (!scan.set_face(face, resolution)) continue;
      const std::uint32_t first_pixel = first_pixel_of(face, resolution);
      scan.for_each_run([&](std::uint32_t row, std::uint32_t first, std::uint32_t end) {
        const std::uint32_t row_pixel = first_pixel + row * resolution;
        bitmap.cover_run(row_pixel + first, row_pixel + end);
      });
    }
  });
}

bool can_not_shadow(const Vec3& surface_point, const Vec3& surface_normal, const Vec3& shooter_centre,
                    const Box& beyond) {
  if (!(beyond.lo.x <= beyond.hi.x)) return true;  // nothing beyond
  // Side of the surface's plane a point is on: -1, 0, +1. As an angle, so that the answer does not depend on the scale:
  // points seen within 4e-6 of the plane are on it, for surfaces are planar within 1e-6 of their size and not better.
  const auto side_of = [&](const Vec3& point) {
    const Vec3 offset = point - surface_point;
    const Vec3 size = glm::abs(offset);  // its largest coordinate: no square that overflows for a box without end
    const double height = glm::dot(surface_normal, offset), limit = 4e-6 * std::max({size.x, size.y, size.z});
    return height > limit ? 1 : (height < -limit ? -1 : 0);
  };
  const int shooter_side = side_of(shooter_centre);
  if (shooter_side == 0) return true;  // edge-on
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner{i & 1 ? beyond.hi.x : beyond.lo.x, i & 2 ? beyond.hi.y : beyond.lo.y,
                      i & 4 ? beyond.hi.z : beyond.lo.z};
    if (side_of(corner) == -shooter_side) return false;
  }
  return true;
}

}  // namespace lichthof
