/// Where a ray ends on a surface that scatters diffusely, after the mirrors, gloss and glass on its way: what a point, or an
/// eye, sees of the light that the first pass keeps.
#pragma once

#include <cstdint>

#include "core/base/random.hpp"
#include "core/tracing/lit_scene.hpp"

namespace lichthof {

struct DiffuseLanding {
  SurfacePoint at;
  bool met = false;
  Rgb weight{1.0};  ///< what the way there leaves of the light, over the probability of the way
};

/// True where a ray may go on from a surface otherwise than by its diffuse lobe.
bool scatters_on(const TraceScene& trace, std::uint32_t surface);

/// Follows a ray that has met a mirror, gloss or glass to where it lands; one way is drawn where there are several, so that the
/// mean over many is that of all. @param landing  what was met first @param direction  unit
/// @returns what it sees of luminaires on the way that shadow rays do not know (π L, W/m²)
/// @cost  a ray for each surface on the way
Rgb follow(const LitScene& scene, DiffuseLanding& landing, Vec3 direction, Random& random, std::uint64_t& rays);

}  // namespace lichthof
