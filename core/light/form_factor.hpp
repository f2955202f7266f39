/// Form factors from receiver points to a shooter's polygon, in Lambert's closed form [Baum89]: scalar double precision
/// here; 16 receivers at a time in core/light/kernels.
#pragma once

#include <span>

#include "core/base/types.hpp"

namespace lichthof {

/// Unoccluded form factor from a receiver point to a planar polygon; the part below the receiver's horizon is clipped.
///
///     F = 1/(2π) Σ_k n · Γ_k,   Γ_k = angle(r_k, r_k+1) · unit(r_k+1 × r_k),   r_k = corner_k - point
///
/// @param point    on the receiver (m)
/// @param normal   unit front normal of the receiver
/// @param corners  shooter, K ≥ 3 coplanar points of a convex polygon, counter-clockwise seen from its front (m)
/// @returns        F in [0, 1] (1); 0 when the point lies on or behind the shooter's plane
/// @error          none; relative error below 1e-12 from distance/size 1e-6 to 1e4
/// @cost           K square roots, K arc tangents
/// @source         [Baum89], the point-to-polygon closed form; paper §2, "form factors are evaluated analytically"
double form_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> corners);

/// The same for a receiver point at the origin and a polygon, of its front alone, that lies above the horizon altogether.
/// @pre nothing is clipped and nothing checked; at most the polygon's edges lie on the horizon
double form_factor_at_origin(const Vec3& normal, std::span<const Vec3> corners);

/// Mean of the corners of the polygon's part above the horizon of (point, normal): a point of it that the receiver can
/// really see, where a shadow ray may aim. @returns false when nothing is above
bool visible_point(const Vec3& point, const Vec3& normal, std::span<const Vec3> corners, Vec3& target);

}  // namespace lichthof
