#include "actors/meter.hpp"

#include <algorithm>

namespace lichthof::actors {

std::uint64_t Meter::busy_ns_now() const {
  for (;;) {
    const std::int64_t since = since_ns;
    const std::uint64_t before = busy_ns;
    if (since != since_ns) continue;  // a handler began or ended meanwhile
    return before + (since == 0 ? 0 : static_cast<std::uint64_t>(std::max<std::int64_t>(0, steady_ns() - since)));
  }
}

void Meters::add(std::shared_ptr<const Meter> meter) {
  const std::lock_guard lock(mutex_);
  meters_.push_back(std::move(meter));
}

std::vector<std::shared_ptr<const Meter>> Meters::all() const {
  const std::lock_guard lock(mutex_);
  return meters_;
}

}  // namespace lichthof::actors
