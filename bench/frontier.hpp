/// Time against error, as plain numbers: which runs no other run beats, and the laws that lie in a row of runs.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/types.hpp"

namespace lichthof::bench {

/// What a run cost and how far from the truth it ended.
struct CostError {
  double cpu_s = 0;
  double error = 0;
};

/// Indices of the runs that no other one equals or beats in both, by rising cost and falling error. Of equal runs the first.
std::vector<std::size_t> frontier(std::span<const CostError> runs);

/// Slope of the line of least squares through (log x, log y): the exponent of y ~ x^slope.
/// @pre two points or more, all coordinates above 0, not all x alike
double log_log_slope(std::span<const Vec2> points);

/// error = c / √(CPU time): how independent samples behave. c is the geometric mean of what the runs say.
class SquareRootLaw {
 public:
  /// @pre one run or more, all of them with a cost and an error above 0
  explicit SquareRootLaw(std::span<const CostError> runs);
  /// CPU seconds to reach an error. @pre error > 0
  double cpu_s(double error) const { return constant_ * constant_ / (error * error); }
  double error(double cpu_s) const;

 private:
  double constant_;  ///< √s
};

}  // namespace lichthof::bench
