#include "actors/meter.hpp"

#include <algorithm>
#include <ctime>

namespace lichthof::actors {

std::uint64_t thread_cpu_ns() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<std::uint64_t>(used.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(used.tv_nsec);
}

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
