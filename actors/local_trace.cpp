// The second pass inside this process; see local_run.hpp.
#include <chrono>
#include <stdexcept>

#include "actors/balancer_actor.hpp"
#include "actors/company.hpp"
#include "actors/local_run.hpp"
#include "actors/system_config.hpp"
#include "actors/worker_actor.hpp"
#include "core/base/check.hpp"

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;

constexpr auto look_every = 50ms;  // at the stop flag
constexpr auto show_every = 200ms;
constexpr std::uint32_t columns_per_step = 1;  // a worker can be stopped after each

/// Waits for the end of the pass. @returns none when the picture is finished or was stopped, else why it failed
caf::error until_the_end(const TraceRun& run, const TraceRecord& record, caf::scoped_actor& self,
                         const BalancerActor& balancer) {
  self->monitor(balancer);
  caf::error reason;
  auto shown = std::chrono::steady_clock::now();
  for (bool over = false; !over;) {
    self->receive(
        [&](const caf::down_msg& down) {
          over = true;
          reason = down.reason;
        },
        caf::after(look_every) >> [] {});
    if (over) break;
    if (run.stop && *run.stop) break;
    if (!run.progress || std::chrono::steady_clock::now() - shown < show_every) continue;
    shown = std::chrono::steady_clock::now();
    run.progress(static_cast<double>(record.finished_columns) / run.source->width());
  }
  return reason;
}

/// Drives the machines until the picture is finished. @post no actor is left
void play(const TraceRun& run, const Clock& clock, const std::shared_ptr<Balancer>& balancer,
          const std::shared_ptr<TraceRecord>& record) {
  SystemConfig config;
  caf::actor_system system(config);
  Company company(system);
  const BalancerActor lead = company.join(system.spawn(balancer_actor, balancer, clock, record, run.meters));
  caf::scoped_actor self{system};
  for (WorkerId id{0}; id.value < run.workers; ++id.value) {
    const auto worker = std::make_shared<Worker>(id, run.source, columns_per_step);
    company.join(system.spawn<caf::detached>(worker_actor, id, worker, lead, clock, run.meters));
  }
  const caf::error failure = until_the_end(run, *record, self, lead);
  company.dismiss();
  if (failure) throw std::runtime_error("the second pass failed: " + text(failure));
}

}  // namespace

TraceResult trace(const TraceRun& run) {
  MUST(run.source && run.workers >= 1);
  BalancerOptions options;
  options.columns = run.source->width();
  options.height = run.source->height();
  options.workers = run.workers;
  options.scheduling = run.scheduling;
  const auto balancer = std::make_shared<Balancer>(options);
  const auto record = std::make_shared<TraceRecord>();
  const Clock clock;
  play(run, clock, balancer, record);

  TraceResult result;
  result.image = balancer->image();
  result.rays = balancer->rays();
  result.jobs = balancer->jobs_assigned();
  result.complete = balancer->finished();
  const Instant end = result.complete ? record->finished : clock.now();
  result.seconds = 1e-9 * static_cast<double>(end.ns);
  for (WorkerId id{0}; id.value < run.workers; ++id.value) {
    const auto last = record->last_result.find(id);
    const Instant since = last == record->last_result.end() ? Instant{} : last->second;
    result.idle_seconds += 1e-9 * static_cast<double>((end - since).ns);
  }
  return result;
}

}  // namespace lichthof::actors
