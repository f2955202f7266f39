#include "actors/worker_actor.hpp"

namespace lichthof::actors {

namespace {

struct WorkerRoute {
  WorkerSelf* self;
  void operator()(ToBalancer, JobRequest&& message) const { self->send(self->state.balancer, message); }
  void operator()(ToBalancer, ColumnResult&& message) const {
    const Duration spent = self->state.clock.now() - self->state.job_began;
    message.seconds = 1e-9 * static_cast<double>(spent.ns);
    self->send(self->state.balancer, std::move(message));
  }
};

}  // namespace

WorkerActor::behavior_type worker_actor(WorkerSelf* self, WorkerId id, std::shared_ptr<Worker> worker,
                                        JobSource balancer, const Clock& clock, const std::shared_ptr<Meters>& meters) {
  report_failures(self, text(Address{id}));
  self->show_meter(meters, text(Address{id}));
  self->set_down_handler([self](caf::down_msg& down) { self->quit(down.reason); });
  self->state.machine = std::move(worker);
  self->state.clock = clock;
  self->state.balancer = std::move(balancer);
  self->monitor(self->state.balancer);
  self->send(self->state.balancer, Enlistment{id, caf::actor_cast<JobSink>(self)});
  wake(self);

  return {
      [=](const JobAssignment& message) {
        self->state.job_began = self->state.clock.now();
        accept(self, ToBalancer{}, id, message);
        if (self->state.machine->resting()) self->quit();
      },
      [=](iterate_atom) { iterate(self, WorkerRoute{self}); },
      [=](wake_atom) { wake(self); },
  };
}

}  // namespace lichthof::actors
