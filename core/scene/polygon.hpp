/// Planar polygons: area, normal, clipping. Everything in double precision; all polygons are simple (no self-crossing).
#pragma once

#include <span>
#include <vector>

#include "core/base/random.hpp"
#include "core/base/types.hpp"

namespace lichthof {

using Polygon = std::vector<Vec3>;
using Polygon2 = std::vector<Vec2>;

/// A uniformly random place in a convex polygon. @param area  of it (m²)
Vec3 random_place(std::span<const Vec3> corners, double area, Random& random);
/// The place in a convex polygon, uniform by area, for a point of the unit square. @param area  of it (m²)
Vec2 place_in(std::span<const Vec2> corners, double area, const Vec2& square);

/// Newell's vector: normal times twice the area (m²); robust for concave and slightly non-planar polygons.
/// @source [Sutherland74], Newell's method
Vec3 newell_vector(std::span<const Vec3> corners);

/// Area (m²) of a planar polygon, ≥ 0.
double area(std::span<const Vec3> corners);
/// Signed area (m²), positive when counter-clockwise.
double signed_area(std::span<const Vec2> corners);

/// Centre of gravity of the area. @pre area > 0
Vec3 centroid(std::span<const Vec3> corners);
Vec2 centroid(std::span<const Vec2> corners);

/// Largest distance (m) of a corner from the plane through the centroid with the Newell normal.
double flatness_defect(std::span<const Vec3> corners);

/// True when every corner turns left (or is straight within rounding) seen from the front.
bool is_convex(std::span<const Vec3> corners);

/// A simple planar polygon cut into convex pieces along diagonals (ear clipping, then Hertel-Mehlhorn merging).
/// Indices refer to `corners`; winding is kept; at most 4 times the optimal number of pieces.
/// @returns empty when the polygon crosses itself (no ear is left)
/// @cost O(n²)
/// @source [Hertel83]
std::vector<std::vector<std::uint32_t>> convex_pieces(std::span<const Vec3> corners);

/// The part of a convex polygon where dot(normal, p) ≥ offset. Corners within `tolerance` of the line count as on it, and
/// stay; a piece that has no corner beyond the tolerance is empty. @cost O(n)
/// @source [Sutherland74]
Polygon clipped(std::span<const Vec3> corners, const Vec3& normal, double offset, double tolerance);
Polygon2 clipped(std::span<const Vec2> corners, const Vec2& normal, double offset, double tolerance);

}  // namespace lichthof
