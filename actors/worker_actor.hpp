/// A worker of the second pass in real time: the machine of core/tracing with a mailbox. Spawn it detached: a step traces
/// for a while, and a worker is meant to fill a core.
#pragma once

#include <memory>

#include "actors/drive.hpp"
#include "core/tracing/worker.hpp"

namespace lichthof::actors {

struct WorkerState : Driven<Worker> {
  static constexpr const char* name = "worker";
  JobSource balancer;
  Instant job_began;
};
using WorkerSelf = caf::stateful_actor<WorkerState, Metered<WorkerActor::base>>;

/// It enlists, works, and quits when it is told that all columns are finished, or when the balancer has gone.
/// @param worker  nobody else touches it while the actor lives
WorkerActor::behavior_type worker_actor(WorkerSelf* self, WorkerId id, std::shared_ptr<Worker> worker,
                                        JobSource balancer, const Clock& clock, const std::shared_ptr<Meters>& meters);

}  // namespace lichthof::actors
