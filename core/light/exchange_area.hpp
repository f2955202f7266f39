/// The exchange area A_1 F_12 = A_2 F_21 of two polygons with nothing between them, as a double integral along their edges:
/// Stokes' theorem, so that no surface is sampled. All of it in double precision.
#pragma once

#include <span>

#include "core/base/types.hpp"

namespace lichthof {

/// Area times view factor of two polygons that see each other wholly.
///
///     A_1 F_12 = 1/(2π) ∮∮ ln |x_1 - x_2| dx_1 · dx_2
///
/// The integral along one edge is taken in closed form; the one along the other by Gauss-Legendre panels of 10 points whose
/// lengths double from the places where the edges come close, so that edges in common and corners that touch cost no digits.
///
/// @param first, second  K ≥ 3 coplanar corners, counter-clockwise seen from the front (m); either may be concave
/// @pre      each polygon lies in front of the other's plane or on it: clip them first
/// @returns  A_1 F_12 ≥ 0 (m²)
/// @error    below 1e-10 of the larger polygon's squared perimeter (closed forms of plates: 1e-11 of F)
/// @cost     per pair of edges that are not perpendicular 10 logarithms where they are far apart, some 400 where they touch
/// @source   [Sparrow63], the contour integral; [Walton02] for one edge in closed form
double exchange_area(std::span<const Vec3> first, std::span<const Vec3> second);

}  // namespace lichthof
