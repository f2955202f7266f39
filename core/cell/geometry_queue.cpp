#include "core/cell/geometry_queue.hpp"

#include "core/base/check.hpp"

namespace lichthof {

namespace {
constexpr std::uint64_t max_ahead = 100000;
}

bool GeometryQueue::file(const GeometryChange& change) {
  if (change.version <= version() || change.version.value > version().value + max_ahead) return false;
  return waiting_.emplace(change.version, change).second;
}

bool GeometryQueue::has_next() const {
  return !waiting_.empty() && waiting_.begin()->first.value == version().value + 1;
}

const GeometryChange& GeometryQueue::take_next() {
  MUST(has_next());
  history_.push_back(std::move(waiting_.begin()->second));
  waiting_.erase(waiting_.begin());
  return history_.back();
}

}  // namespace lichthof
