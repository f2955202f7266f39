/// `--error` and `--check`: a run that knows how accurate it is, and works until it is as accurate as was asked.
///
/// A cheap solution first; a check at what was asked for (points, pixels, all surfaces) tells how far it is from the truth and
/// which part is to blame; the knobs of that part are turned, and so on, to a bounded end. The report has every round.
#pragma once

#include <functional>
#include <optional>

#include "apps/pipeline.hpp"
#include "core/tracing/check_points.hpp"

namespace lichthof::apps {

struct ErrorWish {
  std::optional<double> error;  ///< relative, of what was asked for: ErrorNorm
  bool check = false;           ///< say what was reached, with or without a wish
  bool strict = false;          ///< a wish that is not met is a failure
  bool is_set() const { return error || check; }
};

/// Adds --error --check --strict. @param of  what the error is that of: "the irradiance at the points"
void add_error_options(CLI::App& command, ErrorWish& wish, const std::string& of);

/// What the solution is for: how it will be read, and so what may be done about its error.
enum class Reading : std::uint8_t { as_it_is, at_sensors, in_picture };

/// @error bad_input: the method, or what has been solved already, does not go with the wish
Status wish_fits(const ErrorWish& wish, const Run& run);

/// What is wanted of the solution, and so where an error counts.
struct Question {
  Reading reading = Reading::as_it_is;
  /// @param most  about so many
  std::function<CheckPoints(const LitScene&, std::uint32_t most, std::uint64_t seed)> places;
  std::optional<std::uint32_t> gather_rays;  ///< set by hand; unset: chosen. 0: interpolates
};

/// Solves the scene, or takes the solution that was loaded, to the error that is wished for. A run that was interrupted keeps
/// what it has; one that can't reach the error warns, and has the light it has.
/// @returns the knobs to read the solution with
Expected<ErrorKnobs> reach(Run& run, const ErrorWish& wish, const Question& question, const Interruption& interruption);

/// What --strict makes of the run, once its results are written. @error failed
Status strictly(const ErrorWish& wish, Run& run);

}  // namespace lichthof::apps
