/// The load balancer of the second pass in real time: the machine of core/tracing with a mailbox.
#pragma once

#include <atomic>
#include <map>
#include <memory>

#include "actors/drive.hpp"
#include "core/tracing/balancer.hpp"

namespace lichthof::actors {

/// What a second pass leaves behind besides the picture, and shows while it is under way.
struct TraceRecord {
  std::atomic<std::uint32_t> finished_columns{0};
  // Written by the balancer's actor; to be read when that has ended.
  std::map<WorkerId, Instant> last_result;
  Instant finished;
};

struct BalancerState : Driven<Balancer> {
  static constexpr const char* name = "balancer";
  std::shared_ptr<TraceRecord> record;
  std::map<caf::actor_addr, WorkerId> workers;  ///< enlisted and alive
  std::map<WorkerId, JobSink> sinks;
};
using BalancerSelf = caf::stateful_actor<BalancerState, Metered<BalancerActor::base>>;

/// It quits when the picture is finished and the last worker has gone, or, with the reason of the loss, when no worker is
/// left before that.
/// @param balancer  nobody else touches it while the actor lives
BalancerActor::behavior_type balancer_actor(BalancerSelf* self, std::shared_ptr<Balancer> balancer, const Clock& clock,
                                            std::shared_ptr<TraceRecord> record, const std::shared_ptr<Meters>& meters);

}  // namespace lichthof::actors
