#include "actors/meter.hpp"

#include <ctime>

namespace lichthof::actors {

std::uint64_t thread_cpu_ns() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<std::uint64_t>(used.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(used.tv_nsec);
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
