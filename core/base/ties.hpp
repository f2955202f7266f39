/// Choices that rounding must not make: two lengths that are one in the model differ in their last bits at another scale or place,
/// and another choice means another mesh, other rays, another picture.
#pragma once

#include <cmath>

namespace lichthof {

/// What counts as equal, relative to the larger: far above rounding after a few hundred operations, far below what is built.
inline constexpr double tie_share = 1e-9;

/// a > b, and not by rounding; for lengths, areas and other values that are not negative.
inline bool exceeds(double a, double b) { return a > b * (1 + tie_share); }

/// Number of a step on the line, for sorting: equal for values that differ by rounding. Steps begin at no round number, as
/// values do.
inline double step_of(double value, double step) { return std::floor(value / step + 0.37); }

}  // namespace lichthof
