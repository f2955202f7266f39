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

/// Light at a point (W/m²), straight from luminaires and by way of surfaces.
struct PointLight {
  Rgb direct{0.0}, indirect{0.0};
  Rgb total() const { return direct + indirect; }
};

enum class IndirectMethod : std::uint8_t {
  gather,       ///< rays that read the solution where they land
  interpolate,  ///< the solution at the point itself; points in free air are gathered all the same
};

struct ProbeOptions {
  IndirectMethod indirect = IndirectMethod::gather;
  std::uint32_t gather_rays = 192;
  std::uint64_t seed = 0;  ///< another one: other rays of the gather
  DirectOptions direct;
  /// Samplings of the luminaires whose mean counts. Each has a seed that follows from the point: places that all points would
  /// aim at alike fall into step with slats and railings.
  std::uint32_t direct_rounds = 1;
};

/// @param gather_rays  0: interpolated @param direct_rays  to all luminaires together, > 0
ProbeOptions probe_options(std::uint32_t gather_rays, std::uint32_t direct_rays);

/// Irradiance per sensor point, in their order. A point within 1e-5 of the scene's size of a surface whose normal
/// agrees lies on that surface, and is not shadowed by it. A zero normal gives zero.
/// @param rays  grows by the number of rays
/// @pre   the scene holds a solution
/// @cost  direct 5 µs + gather 30 µs for 192 rays, or 0.5 µs interpolated; results do not depend on the threads
std::vector<PointLight> sensor_light(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                     const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays);
/// Both parts together (W/m²).
std::vector<Rgb> sensor_irradiance(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                   const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays);

}  // namespace lichthof
