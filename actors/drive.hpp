/// How an actor drives a machine; the same few lines for each of them:
///
///     message ──► accept ──► work? ──► `iterate` to oneself ──► step ──► deliver ──► work? ──► `iterate` …
///
/// The actor goes through its mailbox between two steps, so messages slip in. At most one `iterate` is under way.
#pragma once

#include <chrono>
#include <memory>
#include <utility>

#include "actors/log.hpp"
#include "actors/meter.hpp"
#include "actors/wire.hpp"

namespace lichthof::actors {

/// The clock of a run; all its actors have a copy.
class Clock {
 public:
  Instant now() const {
    return {std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start_).count()};
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What the state of such an actor holds. Whoever made the machine may look at it again once the actor has ended.
template <class Machine>
struct Driven {
  std::shared_ptr<Machine> machine;
  Clock clock;
  bool woken = false;  ///< an `iterate` is under way
};

template <class Self>
void wake(Self* self) {
  auto& driven = self->state;
  if (driven.woken || !driven.machine->has_work()) return;
  driven.woken = true;
  self->send(self, iterate_atom_v);
}

template <class Self>
void accept(Self* self, const Address& from, const Address& to, Message message) {
  self->state.machine->accept({from, to, std::move(message)}, self->state.clock.now());
  wake(self);
}

/// Effects become sends. @param route  has an operator()(address, message&&) for all the machine may say to anybody
template <class Self, class Route>
void deliver(Self* self, Effects effects, const Route& route) {
  log_events(effects.events);
  for (Envelope& envelope : effects.outbox) {
    const auto send = [&](const auto& to, auto& message) {
      if constexpr (requires { route(to, std::move(message)); })
        route(to, std::move(message));
      else
        log_undeliverable(envelope.to);
    };
    std::visit(send, envelope.to, envelope.message);
  }
  if (!effects.wake_at) return;
  const std::int64_t wait_ns = std::max<std::int64_t>(0, effects.wake_at->ns - self->state.clock.now().ns);
  self->delayed_send(self, std::chrono::nanoseconds(wait_ns), wake_atom_v);
}

/// Answer to `iterate`: one step.
template <class Self, class Route>
void iterate(Self* self, const Route& route) {
  auto& driven = self->state;
  driven.woken = false;
  if (!driven.machine->has_work()) return;
  Effects effects = driven.machine->step(driven.clock.now());
  self->meter().steps.fetch_add(1, std::memory_order_relaxed);
  self->meter().rays.fetch_add(effects.work.rays, std::memory_order_relaxed);
  self->meter().bytes.fetch_add(effects.work.bytes_sent, std::memory_order_relaxed);
  deliver(self, std::move(effects), route);
  wake(self);
}

}  // namespace lichthof::actors
