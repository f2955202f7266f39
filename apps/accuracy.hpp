/// `--error` and `--check`: a run that knows how accurate it is, and works until it is as accurate as was asked.
///
/// A cheap solution first; a check at random points tells how far it is from the truth and which part is to blame; the knobs
/// of that part are turned, and so on. The report has every round.
#pragma once

#include <optional>

#include "apps/pipeline.hpp"

namespace lichthof::apps {

struct ErrorWish {
  std::optional<double> error;  ///< RMS over the surfaces' area of E - E_exact, relative to RMS(E_exact)
  bool check = false;           ///< say what was reached, with or without a wish
  bool is_set() const { return error || check; }
};

/// Adds --error --check.
void add_error_options(CLI::App& command, ErrorWish& wish);

/// What the solution is for: how it will be read, and so what may be done about its error.
enum class Reading : std::uint8_t { as_it_is, at_sensors, in_picture };

/// @error bad_input: the method, or what has been solved already, does not go with the wish
Status wish_fits(const ErrorWish& wish, const Run& run);

/// Solves the scene, or takes the solution that was loaded, to the error that is wished for. A run that was interrupted keeps
/// what it has.
/// @param gather_rays  set by hand; unset: chosen. 0: interpolates
/// @returns the knobs to read the solution with
Expected<ErrorKnobs> reach(Run& run, const ErrorWish& wish, Reading reading, std::optional<std::uint32_t> gather_rays,
                           const Interruption& interruption);

}  // namespace lichthof::apps
