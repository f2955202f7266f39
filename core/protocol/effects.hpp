/// The only way out of a machine: what a step wants sent, when it wants to be woken, what work it did, what happened.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/protocol/events.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof {

/// Who a message is for. A role, not a place: the driver knows where the role lives.
struct ToController {
  auto operator<=>(const ToController&) const = default;
};
struct ToBalancer {
  auto operator<=>(const ToBalancer&) const = default;
};
using Address = std::variant<ToController, ToBalancer, CellId, WorkerId>;

struct Envelope {
  Address from, to;
  Message message;
};

/// What the light work of a step was, for monitoring and for the cost model of virtual time.
struct WorkDone {
  std::uint64_t rays = 0, form_factors = 0, clusters_tested = 0;
  std::uint64_t bitmaps_projected = 0, pixels_traced = 0;
  std::uint64_t bytes_sent = 0;
  bool nothing() const { return !rays && !form_factors && !clusters_tested && !bitmaps_projected && !pixels_traced; }
};

/// Order contract: the driver sends the outbox in its order, after the step's work is over.
struct Effects {
  std::vector<Envelope> outbox;
  std::optional<Instant> wake_at;
  WorkDone work;
  std::vector<Event> events;
};

}  // namespace lichthof
