/// How fast a node really is, beside what it measured when it joined: it alone decides which nodes count as slow.
///
/// A node measures the share of a core that its actors got while they had work: 1 where nothing is in their way, 0.1 on a
/// machine whose owner needs the rest. It is compared with what others get, so that a lab that is slow as a whole is not.
///
///     usual ──smoothed share < slow_below · others'──► slow ──above trusted_above · others' for a probation──► usual
///
/// Each probation is twice as long as the one before: a node that is slow every minute is left alone.
#pragma once

#include <algorithm>

#include "core/base/types.hpp"

namespace lichthof {

struct PaceOptions {
  double slow_below = 0.35, trusted_above = 0.6;
  Duration probation{20'000'000'000};
};

class Pace {
 public:
  /// One report's share; what counts is the mean of it and of those before, a quarter of it the latest. What can not be is ignored.
  /// @param others  the median share of the other nodes at work; 1 where there is none
  /// @returns whether the node has become slow, or is so no more
  bool measured(double share, double others, const PaceOptions& options, Instant now);

  bool is_slow() const { return is_slow_; }
  double share() const { return share_; }
  /// What is left of its speed, 1 unless it is slow.
  double factor() const { return is_slow_ ? std::clamp(slowest_, 0.01, 1.0) : 1.0; }

 private:
  double share_ = 1;    ///< smoothed
  double slowest_ = 1;  ///< relative to others', since it is slow
  bool is_slow_ = false;
  Duration probation_;  ///< of the next time; 0: the options'
  Instant trusted_at_;
};

}  // namespace lichthof
