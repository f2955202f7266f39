/// An actor system whose scheduler runs only when told to, in one fixed order and in virtual time.
#pragma once

#include <caf/all.hpp>
#include <caf/scheduler/test_coordinator.hpp>

#include "actors/wire.hpp"

namespace lichthof::test {

struct TestSystem {
  struct Config : caf::actor_system_config {
    Config() {
      add_message_types<caf::id_block::lichthof>();
      set("scheduler.policy", caf::atom("testing"));
    }
  };
  Config config;
  caf::actor_system system{config};
  caf::scheduler::test_coordinator& scheduler = dynamic_cast<caf::scheduler::test_coordinator&>(system.scheduler());
  caf::scoped_actor self{system};

  /// Reason of an actor's end, told to `self`, which monitors it; fails when it has not ended.
  caf::error reason_of_end() {
    caf::error reason = caf::sec::request_timeout;
    self->receive([&](const caf::down_msg& down) { reason = down.reason; },
                  caf::after(std::chrono::seconds(0)) >> [] {});
    return reason;
  }
};

}  // namespace lichthof::test
