/// From an error that is asked for to the knobs that reach it: where to begin, and what to turn next.
///
/// The error of the light at a point has four parts, each with a knob of its own (sizes measured by core/tracing/error_check):
///
/// | part           | what it is                                            | knob                              |
/// |----------------|-------------------------------------------------------|-----------------------------------|
/// | visibility     | luminaires sampled by few rays                        | rays to the luminaires            |
/// | reconstruction | the solution interpolated, or gathered by few rays    | rays of the final gather          |
/// | discretisation | elements too large for what the light does            | elements: all, or where it is due |
/// | convergence    | light that has not been shot                          | eps                               |
#pragma once

#include <cstdint>
#include <optional>

#include "core/tracing/error_check.hpp"

namespace lichthof {

struct ErrorKnobs {
  std::uint32_t elements = 12000;
  double eps = SolveOptions{}.eps;
  std::uint32_t gather_rays = 0;    ///< 0: the solution is interpolated
  std::uint32_t direct_rays = 512;  ///< to all luminaires together; 0: direct light is interpolated too
  double keep =
      1;  ///< below 1: elements are refined until this share of their deviations is left (core/light/refinement)
  bool counts_gather = true;  ///< false: a point takes as many rays as its light needs
  bool direct_is_solved() const { return direct_rays == 0; }
  bool is_gathered() const { return gather_rays > 0; }
  bool operator==(const ErrorKnobs&) const = default;
};

/// How each knob may be turned. What a user has set by hand stays.
struct ErrorLimits {
  bool turns_elements = true, turns_eps = true, turns_gather = true, turns_direct = true;
  bool begins_interpolated =
      false;  ///< a gather costs more than a finer mesh: it comes when the first round asks for it
  std::uint32_t most_elements = 1000000;
  static constexpr std::uint32_t most_gather_rays = 16384, most_direct_rays = 16384;
  static constexpr double least_eps = 1e-7;
};

enum class ErrorPart : std::uint8_t { visibility, reconstruction, discretisation, convergence };
const char* name_of(ErrorPart part);

/// Relative errors, as ErrorEstimate has them.
struct ErrorParts {
  double visibility = 0, reconstruction = 0, discretisation = 0, convergence = 0;
  ErrorPart dominant() const;
};

/// Relative RMS deviation of light that is read once more with other rays: what one reading has of noise.
struct ReadingNoise {
  std::optional<double> direct, indirect;  ///< unset: the solution is read as it is
};

/// @param unshot  RMS of the irradiance that unshot light is expected to bring yet, relative to that of all. It is in the
///                solution as an estimate, which is trusted to a third.
ErrorParts parts_of(const ErrorEstimate& estimate, double unshot, const ReadingNoise& noise);

/// Where to begin, so that most scenes need no more than one turn. @param limits  knobs that may not be turned keep `given`
ErrorKnobs first_knobs(double wanted, const ErrorKnobs& given, const ErrorLimits& limits);

/// Turns what keeps the error above what is wanted, as far as the law of each part says. What is read as the solution has it is as
/// fine as the mesh: smaller receivers come first where direct light is read as well, else a final gather, if it may.
/// @returns nothing when there is nothing left to turn
std::optional<ErrorKnobs> turned(const ErrorKnobs& now, const ErrorParts& parts, double wanted,
                                 const ErrorLimits& limits);

}  // namespace lichthof
