/// Where an error is looked for: at the points that were asked for, at what the pixels of a picture show, or all over the
/// surfaces, and how the errors there make one figure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/tracing/camera.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/probe.hpp"

namespace lichthof {

struct CheckPoint {
  SurfacePoint at;
  double weight = 1;  ///< in the mean over all points
  Rgb share{1.0};     ///< of the irradiance there that counts: at a pixel, what is sent to the eye (1/sr)
};

enum class ErrorNorm : std::uint8_t {
  of_all,   ///< RMS of E - E_exact, relative to the RMS of E_exact
  of_each,  ///< RMS of (E - E_exact) / E_exact, where E_exact is at least a hundredth of the mean
};

struct CheckPoints {
  std::vector<CheckPoint> points;
  ErrorNorm norm = ErrorNorm::of_all;
  bool is_all = false;   ///< not a sample: nothing else was asked for
  double white = 1e300;  ///< values above count as this one
};

/// The sensor points themselves: all, or a random subset, one of each run of neighbours in the list.
CheckPoints sensor_check_points(const LitScene& scene, std::span<const SensorPoint> sensors, std::uint32_t most,
                                std::uint64_t seed);

/// What random pixels show, one of each cell of a grid over the film. Pixels that show nothing or what emits are left out.
/// White is what a tone-mapped picture shows as white: `white_factor` over the exposure's factor.
/// @param exposure  factor of radiance; 0: chosen by the log-average of what the solution sends from these points
/// @pre the scene holds a solution
CheckPoints picture_check_points(const LitScene& scene, const PinholeCamera& camera, double exposure,
                                 std::uint32_t most, std::uint64_t seed);

/// Random points of all surface sides that light can reach, even over their area, each judged by its own light. The same seed
/// and solution give the same points. @pre the scene holds a solution
CheckPoints surface_check_points(const LitScene& scene, std::uint32_t count, std::uint64_t seed);

}  // namespace lichthof
