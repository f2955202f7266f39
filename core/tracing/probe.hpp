/// Irradiance at sensor points, as the user asked for them: on surfaces or in free air.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/tracing/final_gather.hpp"
#include "core/tracing/lit_scene.hpp"

namespace lichthof {

struct SensorPoint {
  Vec3 point, normal;  ///< world (m); the normal need not be unit; light is counted on the side it points to
};

enum class IndirectMethod : std::uint8_t {
  gather,       ///< rays that read the solution where they land
  interpolate,  ///< the solution at the point itself; points in free air are gathered all the same
};

struct ProbeOptions {
  IndirectMethod indirect = IndirectMethod::gather;
  std::uint32_t gather_rays = 192;
  DirectOptions direct;
};

/// Irradiance (W/m²) per sensor point, in their order. A point within 1e-5 of the scene's size of a surface whose normal
/// agrees lies on that surface, and is not shadowed by it. A zero normal gives zero.
/// @param rays  grows by the number of rays
/// @pre   the scene holds a solution
/// @cost  direct 5 µs + gather 30 µs for 192 rays, or 0.5 µs interpolated; results do not depend on the threads
std::vector<Rgb> sensor_irradiance(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                   const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays);

}  // namespace lichthof
