#include "sim/lab_run.hpp"

#include <algorithm>
#include <utility>

#include "core/base/check.hpp"

namespace lichthof::sim {

namespace {

constexpr std::uint32_t columns = 24;
constexpr Duration seconds(std::int64_t count) { return {count * 1'000'000'000}; }
/// Long enough for every node to be back, and for a job that still waited for one to have lost patience.
constexpr Duration settling = seconds(60);

/// Columns that say which they are, each of as many rays.
ColumnResult result_of(std::uint32_t slot, const ColumnJob& job) {
  ColumnResult result{WorkerId{slot}, job, {}, {}, 0};
  for (std::uint32_t column = job.first; column < job.last; ++column) {
    result.pixels.push_back(Rgbf{static_cast<float>(column)});
    result.rays.push_back(column);
  }
  return result;
}

bool is_whole(const Balancer& balancer) {
  for (std::uint32_t column = 0; column < columns; ++column)
    if (balancer.image().at(column, 0).x != static_cast<float>(column)) return false;
  return balancer.rays() == columns * (columns - 1) / 2;
}

/// Shorter than a real lab's, so that a scenario sees every rule at work within a minute.
DispatcherOptions short_options(Random& random) {
  DispatcherOptions options;
  options.lease = seconds(4);
  options.checkpoint_every = seconds(2);
  options.patience = seconds(30);
  options.hosting_lease = seconds(8);
  options.checkpoint_lease = seconds(6);
  options.gathering = seconds(1);
  options.settling = seconds(3);
  options.pace.probation = seconds(5);
  options.most_running_jobs = 1 + random.below(4);
  options.heuristic = static_cast<Placement>(random.below(3));
  return options;
}

}  // namespace

LabRun::LabRun(const LabRunOptions& options)
    : options_(options), random_(options.seed), dispatcher_(short_options(random_)) {
  if (options_.only)
    draw_equal_lab();
  else
    draw_lab();
}

void LabRun::draw_equal_lab() {
  DispatcherOptions unhurried;
  unhurried.lease = seconds(60);  // what hangs is not lost meanwhile
  dispatcher_ = Dispatcher(unhurried);
  nodes_.resize(8);
  links_.resize(nodes_.size(), 0);
  for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot) {
    nodes_[slot].facts = {"node" + std::to_string(slot + 1), 1, 1'000'000'000, 100.0};
    events_.push(Instant{}, Boot{slot});
  }
  submissions_left_ = 1;
  events_.push(Instant{} + seconds(1), Submit{options_.wish.value_or(JobWish{})});
  events_.push(Instant{}, Calm{});
  events_.push(options_.only->at, Slow{0, options_.only->pace, options_.only->hangs});
}

void LabRun::draw_lab() {
  nodes_.resize(1 + random_.below(5));
  links_.resize(nodes_.size(), 0);
  for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot) {
    nodes_[slot].facts = {"node" + std::to_string(slot + 1), 1 + random_.below(4),
                          1'000'000 + std::uint64_t{random_.below(6'000'000)}, 50.0 + random_.below(150)};
    const bool is_late = random_.below(3) == 0;
    events_.push(Instant{} + drawn(0, is_late ? 30 : 1), Boot{slot});
  }
  submissions_left_ = 1 + random_.below(6);
  for (std::uint32_t k = 0; k < submissions_left_; ++k) {
    JobWish wish;
    wish.title = "wish" + std::to_string(k);
    wish.radiosity = random_.below(4) != 0;
    wish.picture = !wish.radiosity || random_.below(2) == 0;
    wish.grid = {1 + random_.below(3), 1 + random_.below(2), 1 + random_.below(2)};
    const std::uint32_t most = random_.below(8) == 0 ? 4000 : 700;
    for (std::uint32_t cell = 0; cell < wish.grid[0] * wish.grid[1] * wish.grid[2]; ++cell)
      wish.patches.push_back(random_.below(most));
    wish.bytes_per_patch = 1000;
    wish.base_bytes = random_.below(300'000);
    wish.priority = static_cast<std::int32_t>(random_.below(3));
    events_.push(Instant{} + drawn(0, 30), Submit{wish});
  }
  if (options_.with_faults)
    for (std::uint32_t k = 2 + random_.below(16); k > 0; --k)
      events_.push(Instant{} + drawn(0.5, double(options_.calm_at.ns) / 1e9), Fault{});
  events_.push(options_.calm_at, Calm{});
}

LabReport LabRun::run() {
  while (!events_.empty() && oracle_.broken().empty() && !is_over()) {
    Event event = events_.pop();
    ++report_.events;
    if (!postponed(event)) std::visit([this](auto& e) { handle(e); }, event);
    lead();
    oracle_.look(dispatcher_, controller_is_up_, events_.now());
    oracle_.forget_cells();
    for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot)
      oracle_.look(node_of(slot), nodes_[slot], nodes_[slot].facts.memory_bytes);
    if (events_.now() < options_.give_up_at) continue;
    for (const auto& [id, job] : dispatcher_.jobs())
      if (!has_ended(job.state)) oracle_.complain("job " + std::to_string(id.value) + " never ended: " + job.reason);
    oracle_.complain("a wish was never submitted");
  }
  report_.end = events_.now();
  report_.jobs = dispatcher_.jobs().size();
  for (const auto& [id, job] : dispatcher_.jobs()) {
    report_.done += job.state == JobState::done;
    report_.failed += job.state == JobState::failed;
    report_.cancelled += job.state == JobState::cancelled;
    report_.moves += job.moves;
  }
  if (!oracle_.broken().empty())
    report_.broken = oracle_.broken() + " (at " + std::to_string(report_.end.ns / 1'000'000) + " ms)";
  return report_;
}

bool LabRun::is_over() const {
  const auto& jobs = dispatcher_.jobs();
  return is_calm_ && controller_is_up_ && submissions_left_ == 0 &&
         std::all_of(jobs.begin(), jobs.end(), [](const auto& entry) { return has_ended(entry.second.state); });
}

// ---- Orders -----------------------------------------------------------------------------------------------------------

void LabRun::lead() {
  const Instant now = events_.now();
  if (!controller_is_up_ || !dispatcher_.has_work(now)) return;
  const Dispatched dispatched = dispatcher_.step(now);
  journal_.insert(journal_.end(), dispatched.records.begin(), dispatched.records.end());
  for (const Order& order : dispatched.orders) {
    oracle_.ordered(order, dispatcher_);
    carry_out(order);
  }
  if (dispatcher_.has_work(now)) return oracle_.complain("a step leaves work undone");
  if (dispatched.wake_at && (!wake_is_due_ || *dispatched.wake_at < *wake_is_due_)) {
    wake_is_due_ = dispatched.wake_at;
    events_.push(*dispatched.wake_at, Wake{});
  }
}

void LabRun::carry_out(const Order& order) {
  if (const auto* host = std::get_if<HostRun>(&order)) {
    carry_out_hosting(*host);
  } else if (const auto* begin = std::get_if<BeginPass>(&order)) {
    DriverRun& run = runs_.at(begin->job);
    run.begun = true;
    for (const std::uint32_t slot : run.pass == Pass::radiosity ? run.hosts : run.ready) {
      const auto share = nodes_[slot].shares.find({begin->job, begin->epoch});
      const bool holds =
          nodes_[slot].link != links_[slot] || (share != nodes_[slot].shares.end() && share->second.hosted);
      oracle_.began(*begin, node_of(slot), holds);
      send_to_node(slot, {Kind::begin, begin->job, begin->epoch, begin->pass});
    }
    for (const std::uint32_t slot : run.ready) tell_balancer(begin->job, run, JobRequest{WorkerId{slot}});
  } else if (const auto* release = std::get_if<ReleaseRun>(&order)) {
    DriverRun& run = runs_.at(release->job);
    if (run.epoch != release->epoch) oracle_.complain("the release of another epoch");
    for (const std::uint32_t slot : std::set(run.hosts)) {
      if (release->node && slot_of(*release->node) != slot) continue;
      send_to_node(slot, {Kind::release, release->job, release->epoch});
      if (release->node) forget_share(release->job, run, slot);
    }
    if (!release->node) runs_.erase(release->job);
  } else if (const auto* take = std::get_if<TakeCheckpoint>(&order)) {
    DriverRun& run = runs_.at(take->job);
    run.checkpoint.clear();
    run.checkpoint_parts.clear();
    for (const std::uint32_t slot : run.hosts) send_to_node(slot, {Kind::checkpoint, take->job, take->epoch});
  } else if (const auto* drop = std::get_if<DropNode>(&order)) {
    ++report_.drops;
    const std::uint32_t slot = slot_of(drop->node);
    events_.push(arrival(slot, true), LinkLostByNode{slot, std::exchange(links_[slot], 0)});
    forget(slot);
  } else if (const auto* ended = std::get_if<JobEnded>(&order)) {
    if (runs_.contains(ended->job)) oracle_.complain("a job ended without being released");
    check_failure(*ended);
  } else {
    ++report_.drained;
  }
}

void LabRun::carry_out_hosting(const HostRun& order) {
  DriverRun& run = runs_[order.job];
  const JobWish& wish = dispatcher_.jobs().at(order.job).wish;
  const bool is_new = run.epoch != order.epoch;
  if (is_new && run.epoch != Epoch{}) oracle_.complain("a run is hosted anew before it was released");
  ++report_.hostings;
  report_.resumed += order.from_checkpoint;
  report_.joined_pictures += !is_new;
  if (is_new) {
    run.epoch = order.epoch;
    run.pass = order.pass;
    if (run.pass == Pass::picture)
      run.balancer.emplace(BalancerOptions{columns, 1, static_cast<std::uint32_t>(order.workers.size()),
                                           Scheduling::adaptive, 4, 64, true});
  }
  if (order.from_checkpoint && !checkpoints_.contains(order.job))
    return oracle_.complain("a run resumes from a checkpoint that nobody kept");
  for (const auto& [node, cells] : order.cells) {
    Message message{Kind::host, order.job, order.epoch, order.pass, wish.base_bytes};
    for (const CellId cell : cells) {
      message.bytes += wish.patches[cell.value] * wish.bytes_per_patch;
      message.rest[cell] =
          order.from_checkpoint ? checkpoints_.at(order.job).at(cell) : double(wish.patches[cell.value]);
    }
    run.hosts.insert(slot_of(node));
    send_to_node(slot_of(node), std::move(message));
  }
  std::uint64_t bytes = wish.base_bytes;
  for (const std::uint32_t patches : wish.patches) bytes += patches * wish.bytes_per_patch;
  for (const auto& worker : order.workers) {
    if (!run.hosts.insert(slot_of(worker.first)).second) oracle_.complain("a node gets its workers twice");
    send_to_node(slot_of(worker.first), {Kind::host, order.job, order.epoch, order.pass, bytes});
  }
}

/// A job that fails after everything was mended must have had a reason that mending does not help.
void LabRun::check_failure(const JobEnded& ended) {
  if (ended.state != JobState::failed || ended.reason.starts_with("lost 3 nodes") ||
      ended.reason.find("out of memory") != std::string::npos ||
      ended.reason.find("did not host it within") != std::string::npos ||
      ended.reason.find("answered no checkpoint") != std::string::npos || events_.now() < options_.calm_at + settling)
    return;
  std::vector<Seat> seats;
  for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot)
    seats.push_back({node_of(slot), nodes_[slot].speed(), nodes_[slot].facts.memory_bytes, 0, 1});
  const LabJob& job = dispatcher_.jobs().at(ended.job);
  std::uint64_t bytes = job.wish.base_bytes;
  for (const std::uint32_t patches : job.wish.patches) bytes += patches * job.wish.bytes_per_patch;
  const bool would_fit =
      job.pass == Pass::picture
          ? bool(workers_on_nodes(bytes, seats))
          : bool(cells_on_nodes(dispatcher_.options().heuristic,
                                {job.wish.grid, job.wish.patches, job.wish.bytes_per_patch, job.wish.base_bytes},
                                seats));
  if (would_fit) oracle_.complain("job " + std::to_string(ended.job.value) + " failed needlessly: " + ended.reason);
}

// ---- What the driver keeps --------------------------------------------------------------------------------------------

void LabRun::tell_balancer(JobId job, DriverRun& run, lichthof::Message message) {
  if (!run.begun || !run.balancer) return;
  run.balancer->accept({lichthof::ToBalancer{}, lichthof::ToBalancer{}, std::move(message)}, events_.now());
  while (run.balancer->has_work())
    for (const Envelope& envelope : run.balancer->step(events_.now()).outbox)
      if (const auto& assignment = std::get<JobAssignment>(envelope.message); !assignment.no_more)
        send_to_node(std::get<WorkerId>(envelope.to).value,
                     {Kind::column, job, run.epoch, run.pass, 0, assignment.job});
}

void LabRun::forget_share(JobId job, DriverRun& run, std::uint32_t slot) {
  run.hosts.erase(slot);
  run.ready.erase(slot);
  tell_balancer(job, run, WorkerLost{WorkerId{slot}});
}

void LabRun::forget(std::uint32_t slot) {
  for (auto& [job, run] : runs_)
    if (run.pass == Pass::picture) forget_share(job, run, slot);
}

void LabRun::handle(ToController& event) {
  const Instant now = events_.now();
  const std::uint32_t slot = event.slot;
  Message& message = event.message;
  if (!controller_is_up_ || event.link < oldest_valid_link_) return;
  if (message.kind == Kind::join) {
    if (event.link < links_[slot]) return;
    if (links_[slot] != 0) forget(slot);
    links_[slot] = event.link;
    return dispatcher_.node_joined(node_of(slot), nodes_[slot].facts, now);
  }
  if (event.link != links_[slot]) return;
  if (message.kind == Kind::report) {
    dispatcher_.node_reported(node_of(slot), message.bytes, now);
    return dispatcher_.node_paced(node_of(slot), message.pace, now);
  }

  const auto found = runs_.find(message.job);
  DriverRun* run = found != runs_.end() && found->second.epoch == message.epoch ? &found->second : nullptr;
  switch (message.kind) {
    case Kind::hosted:
      dispatcher_.hosted(node_of(slot), message.job, message.epoch, now);
      if (!run || !run->hosts.contains(slot)) return;
      run->ready.insert(slot);
      return tell_balancer(message.job, *run, JobRequest{WorkerId{slot}});
    case Kind::host_failed:
      dispatcher_.host_failed(node_of(slot), message.job, message.epoch, "out of memory", now);
      if (run && run->pass == Pass::picture) forget_share(message.job, *run, slot);
      return;
    case Kind::cells_done:
      if (run) run->done.insert(slot);
      if (run && run->done == run->hosts) oracle_.pass_was_done(message.job, Pass::radiosity);
      // Who is late says it all the same: nothing may count twice.
      if (!run || run->done == run->hosts) dispatcher_.pass_finished(message.job, message.epoch, now);
      return;
    case Kind::checkpoint_part:
      if (!run) return dispatcher_.checkpoint_kept(message.job, message.epoch, now);
      run->checkpoint.merge(message.rest);
      run->checkpoint_parts.insert(slot);
      if (run->checkpoint_parts != run->hosts) return;
      if (random_.below(10) == 0) return dispatcher_.checkpoint_failed(message.job, message.epoch, now);
      checkpoints_[message.job] = run->checkpoint;
      return dispatcher_.checkpoint_kept(message.job, message.epoch, now);
    case Kind::column_done:
      if (!run || !run->ready.contains(slot)) return;
      tell_balancer(message.job, *run, result_of(slot, message.columns));
      tell_balancer(message.job, *run, JobRequest{WorkerId{slot}});
      if (!run->balancer->finished()) return;
      report_.second_runs += run->balancer->second_runs();
      if (!is_whole(*run->balancer)) oracle_.complain("a picture is not what its columns are, or counts one twice");
      oracle_.pass_was_done(message.job, Pass::picture);
      return dispatcher_.pass_finished(message.job, message.epoch, now);
    default:
      MUST(!"a message of a node");
  }
}

void LabRun::handle(LinkLostByController& event) {
  if (!controller_is_up_ || links_[event.slot] != event.link) return;
  links_[event.slot] = 0;
  forget(event.slot);
  dispatcher_.node_left(node_of(event.slot), "connection lost", events_.now());
}

void LabRun::handle(Submit& event) {
  if (!controller_is_up_) return events_.push(events_.now() + seconds(1), std::move(event));
  const auto id = dispatcher_.submit(event.wish, events_.now());
  MUST(bool(id));
  oracle_.accepted(*id);
  --submissions_left_;
}

void LabRun::handle(ControllerUp&) {
  auto restored = Dispatcher::restored(dispatcher_.options(), journal_);
  if (!restored) return oracle_.complain("the journal is refused: " + restored.error().text());
  dispatcher_ = *std::move(restored);
  oracle_.restarted();
  if (random_.below(2) == 0) journal_ = dispatcher_.summary();
  controller_is_up_ = true;
  if (is_calm_) end_draining();
}

void LabRun::send_to_node(std::uint32_t slot, Message message) {
  if (links_[slot] != 0) events_.push(arrival(slot, true), ToNode{slot, links_[slot], std::move(message)});
}

}  // namespace lichthof::sim
