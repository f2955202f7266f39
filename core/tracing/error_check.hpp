/// How far the light that was computed is from the truth, measured on the scene itself and independently of how it was
/// computed: at the points it was asked for (core/tracing/check_points), without bias, with a confidence interval.
///
/// The exact irradiance H and radiosity b = ρH obey H = D + G b (direct light, and what a cosine-weighted look around brings
/// of b). For any approximation b̃ the error of b̃ obeys the same equation with its residual as the source:
///
///     e = r + ρ G e,   r = ρ (D + G b̃) − b̃
///
/// so the truth at a point is D + G b̃ + G e, and e is found by random walks that gather the residual where they land. Where b̃
/// is good, e is small: the walks' noise is that of the solution's error, not that of light, and some hundred rays a point do
/// what path tracing needs ten thousand paths for.
///
/// But walks that seldom meet the residual see no error and no noise either: a spot, a slit, a lit floor that the solution has
/// not heard of. So paths that never read the solution are a second witness, whose noise is that of light. The one whose noise
/// falls faster goes on until the answer is decided; where paths find more than the walks can have missed, their word counts.
///
/// @source a known approximation as control variate: [Lafortune95]; iterated on its residual here; confidence by the noise at
/// the points and, where they are a sample, by the spread over them
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/base/parallel.hpp"
#include "core/tracing/check_points.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/probe.hpp"

namespace lichthof {

struct ErrorCheckOptions {
  double wanted = 0;               ///< the answer need only be sure to lie above or below this relative error
  double least = 1e-4;             ///< smaller errors need not be told from none
  std::uint32_t gather_rays = 64;  ///< a point and batch
  std::uint32_t walks = 4;         ///< of a point and batch that go on to find the error of the solution
  std::uint32_t paths = 16384;     ///< that the second witness begins with, over all points
  std::uint64_t most_rays = 0;     ///< no further batch begins beyond so many; 0: until the answer is decided
  std::uint64_t seed = 1;
};

/// Root of a mean square over points and channels, relative to that of the exact light or to each point's own (ErrorNorm),
/// unless said otherwise.
struct ErrorEstimate {
  double error = 0;   ///< of the light as given; no less than two thirds of `high`, so that noise never hides more
  double likely = 0;  ///< the same without regard to noise, as the parts below
  double low = 0, high = 0;  ///< 95 % confidence
  double bias = 0;           ///< mean of (given - exact) over mean of exact
  double visibility = 0;     ///< of the direct light
  double indirect = 0;       ///< of the indirect light,
  double solution = 0;       ///< where it comes from errors of the solution as seen from the points
  double noise = 0;          ///< of the check, taken out of all these
  bool by_paths = false;     ///< paths tell, and the parts, which only walks know, may be less than the whole
  std::uint32_t points = 0, batches = 0;
  std::uint64_t rays = 0;
};

/// @param given  of each point; for methods that do not part them: all in `indirect`, and `visibility` is theirs together
/// @pre   the scene holds a solution
/// @error the estimate of the error's square has a standard deviation of about (error² + noise²)·sqrt(2/points)
/// @cost  about 80 µs a point and batch, 5 µs a path; the answer does not depend on the threads
ErrorEstimate check_error(const std::shared_ptr<const LitScene>& scene, const CheckPoints& places,
                          std::span<const PointLight> given, const ErrorCheckOptions& options,
                          const Parallel& parallel);

}  // namespace lichthof
