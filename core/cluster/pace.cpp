#include "core/cluster/pace.hpp"

#include <cmath>

namespace lichthof {

namespace {
/// A node that drops to a tenth is noticed after five reports; on a busy machine a second says little.
constexpr double latest_counts = 0.25;
}  // namespace

bool Pace::measured(double share, double others, const PaceOptions& options, Instant now) {
  if (!std::isfinite(share) || share < 0) return false;
  share_ += latest_counts * (std::min(share, 1.0) - share_);
  const double relative = share_ / std::clamp(others, 0.01, 1.0);
  if (!is_slow_) {
    if (relative >= options.slow_below) return false;
    is_slow_ = true;
    slowest_ = relative;
    probation_ = {probation_.ns == 0 ? options.probation.ns : 2 * probation_.ns};
    trusted_at_ = now + probation_;
    return true;
  }
  slowest_ = std::min(slowest_, relative);
  if (relative < options.trusted_above) trusted_at_ = now + probation_;
  if (now < trusted_at_) return false;
  is_slow_ = false;
  return true;
}

}  // namespace lichthof
