/// Fills the surfaces of a cell into a hemicube bitmap: scan-line fill of the input polygons, one bit deep.
///
/// No depth is needed: the routing order guarantees that whatever a cell projects is nearer than every cell still to
/// come.
#pragma once

#include <span>

#include "core/light/hemicube_bitmap.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// Covers every pixel whose centre ray, from the frame's centre, meets the polygon in front of the hemicube's base
/// plane. A centre on the outline is covered, so polygons that share an edge leave no gap. Polygons seen edge-on, and
/// those in the base plane, cover nothing. "In" is within 4e-6 of the polygon's reach, as surfaces are flat within 1e-6
/// of their size; small pieces of a much larger surface may deviate more, so leave the shooter's own surface out.
/// @param corners  convex planar polygon, of either winding, world (m); it may reach behind the base plane
/// @error none
/// @cost O(rows touched) per face it reaches; 600 polygons of an office about 50 µs at R = 128, 70 µs at R = 256
void project(const HemicubeFrame& frame, std::span<const Vec3> corners, HemicubeBitmap& bitmap);

/// True when projecting a surface is pointless or wrong: its plane has the shooter's centre and all of `beyond` (the
/// corners of the box around every cell still to come) on one side. Without this rule walls along cell borders draw
/// dark lines (numerics: section 4). "On the plane" is within 4e-6 rad of it, seen from `surface_point`.
bool can_not_shadow(const Vec3& surface_point, const Vec3& surface_normal, const Vec3& shooter_centre,
                    const Box& beyond);

}  // namespace lichthof
