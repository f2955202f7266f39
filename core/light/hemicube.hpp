/// The half cube over a shooter's centre: frame, pixels and directions, delta form factors.
///
/// Face 0 is the top (R x R pixels), faces 1..4 the upper halves of the sides +x, +y, -x, -y (R x R/2): 3 R² pixels in
/// all, numbered face by face, row by row. Local frame: z = the shooter's normal. Every face has coordinates (a, b, w):
/// w is the distance along the face's axis, a runs along its columns, b along its rows; on the face w = 1.
///
///     face   a    b    w      column (R of them): a = -1 + 2(column + ½)/R
///     0      x    y    z      row of the top (R): b = -1 + 2(row + ½)/R
///     1      y    z    x      row of a side (R/2), upwards from the base plane: b = 2(row + ½)/R
///     2     -x    z    y
///     3     -y    z   -x      a of the sides runs counter-clockwise seen from above
///     4      x    z   -y
///
/// @source [Cohen85]
#pragma once

#include <cstdint>

#include "core/base/types.hpp"

namespace lichthof {

struct HemicubeFrame {
  Vec3 centre;                      ///< world (m)
  Vec3 tangent, bitangent, normal;  ///< unit, right-handed
  Vec3 to_local(const Vec3& direction) const {
    return {glm::dot(direction, tangent), glm::dot(direction, bitangent), glm::dot(direction, normal)};
  }
  Vec3 to_world(const Vec3& local) const { return local.x * tangent + local.y * bitangent + local.z * normal; }
};

constexpr std::uint32_t face_count = 5;

/// Number of pixels: 3 R². @pre resolution even
constexpr std::uint32_t pixel_count(std::uint32_t resolution) { return 3 * resolution * resolution; }
/// Rows of a face: R of the top, R/2 of a side.
constexpr std::uint32_t face_rows(std::uint32_t face, std::uint32_t resolution) {
  return face == 0 ? resolution : resolution / 2;
}
/// Number of the face's pixel (column 0, row 0); pixel = that + row R + column.
constexpr std::uint32_t first_pixel_of(std::uint32_t face, std::uint32_t resolution) {
  return face == 0 ? 0 : (face + 1) * (resolution * resolution / 2);
}

/// Coordinates (a, b, w) of a local vector on a face.
inline Vec3 face_coordinates(std::uint32_t face, const Vec3& v) {
  switch (face) {
    case 0:
      return v;
    case 1:
      return {v.y, v.z, v.x};
    case 2:
      return {-v.x, v.z, v.y};
    case 3:
      return {-v.y, v.z, -v.x};
    default:
      return {v.x, v.z, -v.y};
  }
}

/// Centre direction of a pixel, local frame, not normalised (its largest coordinate is 1).
Vec3 pixel_direction(std::uint32_t pixel, std::uint32_t resolution);

/// The pixel that a local direction falls into; on an edge between faces the top wins, then the x sides.
/// @pre z > 0 (z ≤ 0 is taken as the lowest row)
std::uint32_t pixel_of(const Vec3& local_direction, std::uint32_t resolution);

/// Form factor of one pixel seen from the centre (1), by the midpoint rule; over all pixels they sum to 1 + 0.54/R².
///
///     top: ΔA / (π (a² + b² + 1)²),   side: b ΔA / (π (a² + b² + 1)²),   ΔA = 4/R²
///
/// @source [Cohen85]
double delta_form_factor(std::uint32_t pixel, std::uint32_t resolution);

}  // namespace lichthof
