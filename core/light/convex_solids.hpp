/// Convex solids among the surfaces of a scene: boxes, cabinets, columns. What they hide is one shadow, not one for each face.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/light/view_shaft.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

struct ConvexSolid {
  Obstruction shape;
  std::vector<std::uint32_t> surfaces;  ///< its faces
};

/// Surfaces that meet edge to edge and enclose a convex solid, whichever way they look. One face may be missing, as where a
/// box stands on a floor: what enters there leaves through another. Solids of more than 64 faces stay faces.
/// @param tolerance  corners that differ by less are one, unless a rounding border falls between them (m)
/// @cost  O(n log n), and corners times faces of each solid
std::vector<ConvexSolid> convex_solids(std::span<const Surface> surfaces, double tolerance);

/// Whether a convex polygon with its front is outside a solid: no sight from it begins within. It may touch the solid.
/// @param surface  the surface it is a side of
bool is_outside(const ConvexSolid& solid, std::uint32_t surface, std::span<const Vec3> corners, const Vec3& normal,
                double tolerance);

}  // namespace lichthof
