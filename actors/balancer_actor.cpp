#include "actors/balancer_actor.hpp"

namespace lichthof::actors {

namespace {

struct BalancerRoute {
  BalancerSelf* self;
  void operator()(WorkerId to, JobAssignment&& message) const {
    const auto sink = self->state.sinks.find(to);
    if (sink != self->state.sinks.end()) self->send(sink->second, message);  // a lost one gets nothing
  }
};

void enlist(BalancerSelf* self, const Enlistment& enlistment) {
  auto& state = self->state;
  if (!enlistment.sink || !state.workers.emplace(enlistment.sink->address(), enlistment.worker).second) return;
  state.sinks[enlistment.worker] = enlistment.sink;
  self->monitor(enlistment.sink);
}

void lose_worker(BalancerSelf* self, const caf::down_msg& down) {
  auto& state = self->state;
  const auto found = state.workers.find(down.source);
  if (found == state.workers.end()) return;
  const WorkerId worker = found->second;
  state.workers.erase(found);
  state.sinks.erase(worker);
  const bool is_finished = state.machine->finished();
  if (!is_finished) accept(self, ToBalancer{}, ToBalancer{}, WorkerLost{worker});
  if (state.workers.empty()) self->quit(is_finished ? caf::error{} : down.reason);
}

}  // namespace

BalancerActor::behavior_type balancer_actor(BalancerSelf* self, std::shared_ptr<Balancer> balancer, const Clock& clock,
                                            std::shared_ptr<TraceRecord> record,
                                            const std::shared_ptr<Meters>& meters) {
  report_failures(self, "balancer");
  self->show_meter(meters, "balancer");
  self->set_down_handler([self](caf::down_msg& down) { lose_worker(self, down); });
  self->state.machine = std::move(balancer);
  self->state.clock = clock;
  self->state.record = std::move(record);

  return {
      [=](const Enlistment& enlistment) { enlist(self, enlistment); },
      [=](const JobRequest& message) { accept(self, message.worker, ToBalancer{}, message); },
      [=](ColumnResult& message) {
        const WorkerId worker = message.worker;
        self->state.record->last_result[worker] = self->state.clock.now();
        accept(self, worker, ToBalancer{}, std::move(message));
      },
      [=](iterate_atom) {
        auto& state = self->state;
        const bool was_finished = state.machine->finished();
        iterate(self, BalancerRoute{self});
        state.record->finished_columns = state.machine->finished_columns();
        if (!was_finished && state.machine->finished()) state.record->finished = state.clock.now();
      },
      [=](wake_atom) { wake(self); },
  };
}

}  // namespace lichthof::actors
