/// Which surfaces a cell's rays meet, and which its bitmaps leave to the rays of others.
///
/// A ray between two cells is followed twice: by the ray tracer of the receiver's cell, from the receiver to a place of the shooter
/// of its own, and by the bitmap of the cells before, which is seen from one point of the shooter. Where both meet the same
/// opening, in a border or through a wall that a border cuts, light passes only where both are free: too little, by as much as the
/// opening is narrow beside the shooter. And where one meets one half of a wall and one the other, it leaks between. So each
/// surface has one judge, as a whole. It *concerns* a cell when it comes near to it; rays of a cell meet all that concerns the
/// cell, and a bitmap for it leaves that out.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// Whether a surface concerns a cell. @param bounds  of the surface @param rim  how far around its box a cell looks (m)
bool concerns(const Box& bounds, const Box& cell, double rim);

/// The surfaces that concern the cell with this box; nothing when the box holds all of the scene.
std::optional<std::vector<Surface>> surfaces_of(const Scene& scene, const Box& box, double rim);

/// A surface as a cell's bitmaps show it.
struct CoveringSurface {
  std::span<const Vec3> corners;  ///< world (m)
  Vec3 normal;
  Box bounds;
  /// Bit 2 axis, for the high end 2 axis + 1: it belongs to a wall without an opening from edge to edge of this side of the cell.
  std::uint8_t closes = 0;
};

/// What of the cell's surfaces can cover pixels. @param surfaces  must outlive the result
std::vector<CoveringSurface> covering_surfaces(const Scene& scene, std::span<const Surface> surfaces, const Box& box,
                                               double rim);

/// The side of a box that a neighbour in the grid lies at: 2 axis, at the high end 2 axis + 1.
int side_towards(const Box& box, const Box& neighbour);

}  // namespace lichthof
