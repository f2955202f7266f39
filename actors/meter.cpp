#include "actors/meter.hpp"

namespace lichthof::actors {

void Meters::add(std::shared_ptr<const Meter> meter) {
  const std::lock_guard lock(mutex_);
  meters_.push_back(std::move(meter));
}

std::vector<std::shared_ptr<const Meter>> Meters::all() const {
  const std::lock_guard lock(mutex_);
  return meters_;
}

}  // namespace lichthof::actors
