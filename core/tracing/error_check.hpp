/// How far the light that was computed is from the truth, measured on the scene itself and independently of how it was
/// computed: at random points of its surfaces, without bias, with a confidence interval.
///
/// The exact irradiance H and radiosity b = ρH obey H = D + G b (direct light, and what a cosine-weighted look around brings
/// of b). For any approximation b̃ the error of b̃ obeys the same equation with its residual as the source:
///
///     e = r + ρ G e,   r = ρ (D + G b̃) − b̃
///
/// so the truth at a point is D + G b̃ + G e, and e is found by random walks that gather the residual where they land. Where b̃
/// is good, e is small: the walks' noise is that of the solution's error, not that of light, and some hundred rays a point do
/// what path tracing needs ten thousand paths for. Scenes with mirrors, gloss or glass are path traced instead.
///
/// @source a known approximation as control variate: [Lafortune95]; iterated on its residual here; confidence by the spread over points
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/probe.hpp"

namespace lichthof {

struct ErrorCheckOptions {
  double wanted = 0;               ///< the answer need only be sure to lie above or below this relative error
  double least = 1e-4;             ///< smaller errors need not be told from none
  std::uint32_t gather_rays = 64;  ///< a point and batch
  std::uint32_t walks = 4;         ///< of a point and batch that go on to find the error of the solution
  std::uint32_t most_batches = 256;
  std::uint64_t seed = 1;
};

/// Root of a mean square over points and channels, relative to that of the exact irradiance, unless said otherwise.
struct ErrorEstimate {
  double error = 0;          ///< of the light as given
  double low = 0, high = 0;  ///< 95 % confidence
  double bias = 0;           ///< mean of (given - exact) over mean of exact
  double visibility = 0;     ///< of the direct light
  double indirect = 0;       ///< of the indirect light,
  double solution = 0;       ///< where it comes from errors of the solution as seen from the points
  double noise = 0;          ///< of the check, taken out of all these
  std::uint32_t points = 0, batches = 0;
  std::uint64_t rays = 0;
};

struct CheckPoint {
  SurfacePoint at;
  double weight = 1;  ///< in means over area
};

/// Random points of all surface sides that light can reach: half of them even over their area, half where the light is, by the
/// irradiance that the solution has; so one lit room of ten is looked at half as closely as if it were alone. The same seed
/// and solution give the same points.
/// @returns weights in (0, 2], with a mean of about 1
std::vector<CheckPoint> random_surface_points(const LitScene& scene, std::uint32_t count, std::uint64_t seed);

/// @param given  of each point; for methods that do not part them: all in `indirect`, and `visibility` is theirs together
/// @pre   the scene holds a solution
/// @error the estimate of the error's square has a standard deviation of about (error² + noise²)·sqrt(2/points)
/// @cost  about 80 µs a point and batch; the answer does not depend on the threads
ErrorEstimate check_error(const std::shared_ptr<const LitScene>& scene, std::span<const CheckPoint> points,
                          std::span<const PointLight> given, const ErrorCheckOptions& options,
                          const Parallel& parallel);

}  // namespace lichthof
