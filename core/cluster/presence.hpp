/// Whether the owner of a workstation is at it, judged from what can be seen without asking him. Errs in his favour: one
/// sign of him is enough, and only a long time without any lets a node work.
#pragma once

#include <optional>

#include "core/base/types.hpp"

namespace lichthof {

/// What is seen at one look.
struct OwnerSigns {
  std::optional<Duration> since_touch;  ///< of the last terminal or input device; absent: there is none to be seen
  bool is_desktop_active = false;       ///< somebody is logged in whose desktop does not call itself idle
  double others_cores = 0;              ///< that programs of others have used since the look before
};

struct PresenceOptions {
  Duration idle_after{300'000'000'000};  ///< without a sign for as long, the owner is away
  double busy_cores = 0.5;               ///< others that use more are the owner's work; 0: not looked at
  Duration busy_for{5'000'000'000};      ///< for as long: what a machine does by itself at times is shorter
};

class Presence {
 public:
  explicit Presence(const PresenceOptions& options) : options_(options) {}
  /// @pre  `now` never goes back
  /// @returns whether the owner is away
  bool look(const OwnerSigns& signs, Instant now);

 private:
  PresenceOptions options_;
  std::optional<Instant> last_sign_, busy_since_;
};

}  // namespace lichthof
