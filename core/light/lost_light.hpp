/// Luminaires whose light comes to nothing, since they are turned the wrong way: a fault of the model that a dark picture does not explain.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/light/raycast.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

struct LostLight {
  enum class Where : std::uint8_t {
    into_support,  ///< it ends at once in the surface that the luminaire lies on
    out_of_scene,  ///< it meets nothing
  };
  std::uint32_t surface = 0;
  Where where = Where::out_of_scene;
};

/// Every luminaire whose light is lost but for some hundredth at most, in the order of the surfaces.
///
/// Rays from its front, cosine-distributed, meet a surface before a hundredth of its size (√area), or nothing; and of places all
/// over the scene none sees it, so that a sun that few of its own rays prove to shine on a room is not taken for lost. A luminaire
/// that lies in a face, which was cut out there, shines into it.
/// @cost  64 rays for each, some hundred where they all leave; the answer does not depend on the number of threads
std::vector<LostLight> lost_light(const Scene& scene, const RayScene& rays, const Parallel& parallel);

}  // namespace lichthof
