/// What a node sees of its machine's owner: access times of terminals and input devices as w(1) reads them, idle hints of
/// desktops from logind, and the processor time of others in /proc/stat. Needs no right that a plain user lacks.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/cluster/presence.hpp"

// Of libsystemd.
struct sd_bus;

namespace lichthof::apps {

struct OwnerWatchOptions {
  PresenceOptions presence;
  std::vector<std::string> files;  ///< patterns as of a shell; empty: terminals, input devices and desktops
};

class OwnerWatch {
 public:
  explicit OwnerWatch(OwnerWatchOptions options);
  ~OwnerWatch();
  OwnerWatch(const OwnerWatch&) = delete;

  /// @cost some 100 µs; a second where logind does not answer, and then not again for a minute
  bool is_away();

 private:
  using Clock = std::chrono::steady_clock;

  std::optional<Duration> since_touch() const;
  double others_cores(Clock::time_point now);
  bool is_desktop_active(Clock::time_point now);
  std::optional<bool> has_active_desktop();

  OwnerWatchOptions options_;
  Presence presence_;
  Clock::time_point looked_, asked_;
  double others_s_ = 0;  ///< processor time of others at the last look
  bool desktop_active_ = false;
  sd_bus* bus_ = nullptr;
};

/// From now on the process runs when nobody else wants to, with all the threads that it has and starts.
void yield_to_everybody();

}  // namespace lichthof::apps
