/// Events of virtual time in the order (instant, sequence number): never a tie by address, so every run is the same.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "core/base/check.hpp"
#include "core/base/types.hpp"

namespace lichthof::sim {

template <class Event>
class EventQueue {
 public:
  /// @pre `at` is not before the last event popped: nothing happens in the past
  void push(Instant at, Event event) {
    MUST(at >= now_);
    events_.emplace(std::pair{at, next_sequence_++}, std::move(event));
  }
  bool empty() const { return events_.empty(); }
  std::size_t size() const { return events_.size(); }
  /// Time of the last event popped.
  Instant now() const { return now_; }
  /// Earliest event; of several at one instant the one pushed first. @pre not empty
  Event pop() {
    MUST(!events_.empty());
    const auto first = events_.begin();
    now_ = first->first.first;
    Event event = std::move(first->second);
    events_.erase(first);
    return event;
  }

 private:
  std::map<std::pair<Instant, std::uint64_t>, Event> events_;
  std::uint64_t next_sequence_ = 0;
  Instant now_;
};

}  // namespace lichthof::sim
