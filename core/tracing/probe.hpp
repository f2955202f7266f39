/// Irradiance at sensor points, as the user asked for them: on surfaces or in free air.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/tracing/final_gather.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/sensor_point.hpp"

namespace lichthof {

/// Light at a point (W/m²), straight from luminaires and by way of surfaces.
struct PointLight {
  Rgb direct{0.0}, indirect{0.0};
  double standard_error = 0;  ///< of sampling alone, of the mean of the channels of total()
  Rgb total() const { return direct + indirect; }
};

enum class IndirectMethod : std::uint8_t {
  gather,       ///< rays that read the solution where they land
  interpolate,  ///< the solution at the point itself; points in free air are gathered all the same
};

struct ProbeOptions {
  IndirectMethod indirect = IndirectMethod::gather;
  std::uint32_t gather_rays = 192;  ///< at each point
  /// Set: as many rays as this relative standard error of a point's light takes; gather_rays are those of the first round.
  std::optional<double> gather_error;
  double patience = GatherOptions{}.patience;
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
/// @cost  direct 5 µs + gather 30 µs for 192 rays, or 0.5 µs interpolated; in a scene without a solution
///        the gather goes on by paths: 1 µs a ray. Results do not depend on the threads
std::vector<PointLight> sensor_light(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                     const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays);
/// Where few points are asked for, or the light is all shadow rays away, paths from the points cost less than a first pass.
/// @returns the options to read the light by paths alone; nothing where a first pass costs less, or where paths know too little of the
///          scene to tell: most of it is dark to them, or mirrors, gloss and glass hide light from them
/// @pre     the scene holds no solution
/// @cost    128 paths from up to 48 of the points
std::optional<ProbeOptions> options_for_paths(std::shared_ptr<const LitScene> scene,
                                              std::span<const SensorPoint> points, const Parallel& parallel,
                                              std::uint64_t& rays);
/// Both parts together (W/m²).
std::vector<Rgb> sensor_irradiance(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                   const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays);

}  // namespace lichthof
