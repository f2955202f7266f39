/// Rays that leave a group as its light does: from everywhere on it, cosine-distributed. What they meet first tells where the
/// group's light goes.
#pragma once

#include <array>
#include <cstdint>

#include "core/light/raycast.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// One batch: directions in 8 x 8 strata of the cosine-weighted hemisphere, places from a low-discrepancy sequence. Structure of
/// arrays, one entry a ray.
struct GroupRays {
  static constexpr std::uint32_t strata = 8;  ///< along each axis of the hemisphere's unit square
  static constexpr std::uint32_t count = strata * strata;
  std::array<Vec3, count> from, direction;      ///< world (m); unit
  std::array<std::uint32_t, count> surface{};   ///< met first, or RayScene::no_surface
  std::array<double, count> distance{};         ///< m
  std::array<bool, count> front{};              ///< the ray met the front side
  Vec3 meeting_point(std::uint32_t ray) const { return from[ray] + distance[ray] * direction[ray]; }
};

/// @param batch  another one: other rays of the same group
/// @cost  about 5 µs
void cast_from_group(const Mesh& mesh, std::uint32_t group, std::uint32_t batch, const RayScene& rays, GroupRays& out);

}  // namespace lichthof
