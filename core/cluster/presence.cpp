#include "core/cluster/presence.hpp"

#include <algorithm>

namespace lichthof {

bool Presence::look(const OwnerSigns& signs, Instant now) {
  const auto sign_at = [this](Instant at) { last_sign_ = std::max(last_sign_.value_or(at), at); };
  // A touch in the future is one under a clock that was set back: it counts as just now.
  if (signs.since_touch) sign_at({now.ns - std::max<std::int64_t>(0, signs.since_touch->ns)});
  if (options_.busy_cores > 0 && signs.others_cores > options_.busy_cores) {
    if (!busy_since_) busy_since_ = now;
    if (now - *busy_since_ >= options_.busy_for) sign_at(now);
  } else {
    busy_since_.reset();
  }
  // A desktop has waited for its own time before it calls itself idle.
  if (signs.is_desktop_active) return false;
  return !last_sign_ || now - *last_sign_ >= options_.idle_after;
}

}  // namespace lichthof
