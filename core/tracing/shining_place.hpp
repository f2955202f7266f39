/// Where on a luminaire to aim a shadow ray.
#pragma once

#include <span>

#include "core/base/random.hpp"
#include "core/base/types.hpp"

namespace lichthof {

/// A place on a flat luminaire or a part of it, as probable as it brings light to the point. A uniform place would tell how much
/// of the area is seen; this tells how much of the light is.
/// @param area             of the corners (m²)
/// @param emitting_normal  unit, out of the luminaire's front; the point lies in front of it
/// @param fallback         where to aim if no place is found, which happens to what hardly rises above the horizon
/// @cost  some 10 ns a try: 1 to 2 tries far from the luminaire, tens of them right before it
Vec3 shining_place(std::span<const Vec3> corners, double area, const Vec3& emitting_normal, const Vec3& point,
                   const Vec3& normal, const Vec3& fallback, Random& random);

}  // namespace lichthof
