/// The part of the dispatcher that decides: who starts where, what moves, who waits for what.
#include <algorithm>
#include <set>
#include <utility>

#include "core/base/check.hpp"
#include "core/cluster/dispatcher.hpp"

namespace lichthof {

namespace {

/// A move costs a hosting and the way back to the checkpoint: the rest has to become this much shorter to be worth it.
constexpr double worth_moving = 0.7;

CellsToPlace cells_of(const JobWish& wish) { return {wish.grid, wish.patches, wish.bytes_per_patch, wish.base_bytes}; }

std::uint64_t worker_bytes(const JobWish& wish) {
  std::uint64_t sum = wish.base_bytes;
  for (const std::uint32_t patches : wish.patches) sum += patches * wish.bytes_per_patch;
  return sum;
}

void keep_earliest(std::optional<Instant>& earliest, Instant at) {
  if (!earliest || at < *earliest) earliest = at;
}

}  // namespace

void Dispatcher::plan(Instant now) {
  std::uint32_t running = 0;
  for (auto& [id, job] : jobs_)
    if (job.run) {
      begin(id, job, now);
      move_cells(id, job, now);
      ask_for_checkpoint(id, job, now);
      ++running;
    }

  std::vector<JobId> queue;
  for (const auto& [id, job] : jobs_)
    if (job.state == JobState::queued) queue.push_back(id);
  std::stable_sort(queue.begin(), queue.end(),
                   [&](JobId a, JobId b) { return jobs_.at(a).wish.priority > jobs_.at(b).wish.priority; });
  std::optional<JobId> wants_memory;
  for (const JobId id : queue) {
    LabJob& job = jobs_.at(id);
    const bool is_considered = running < options_.most_running_jobs && !wants_memory;
    if (!is_considered) {
      job.hopeless_since.reset();
      job.reason = wants_memory ? "waits behind job " + std::to_string(wants_memory->value)
                                : "waits, " + std::to_string(running) + " jobs are running";
      continue;
    }
    if (start(id, job, now)) wants_memory = id;
    running += job.run.has_value();
  }

  for (auto& [id, job] : jobs_)
    if (job.run && job.run->pass == Pass::picture) {
      move_workers(id, job, wants_memory.has_value(), now);
      begin(id, job, now);  // the one awaited may have been sent away
    }
  look_for_drained();
}

// ---- Starting ---------------------------------------------------------------------------------------------------------

/// @returns whether the job waits for memory that others hold, so that nobody may overtake it
bool Dispatcher::start(JobId id, LabJob& job, Instant now) {
  Expected<Place> found = place(job, Room::now);
  if (found) {
    host(id, job, *std::move(found), now);
    return false;
  }
  if (place(job, Room::others_end)) {
    job.hopeless_since.reset();
    job.reason = "waits for memory that other jobs hold: " + found.error().message;
    return true;
  }
  wait_for_the_lab(id, job, found.error(), now);
  return false;
}

void Dispatcher::wait_for_the_lab(JobId id, LabJob& job, const Error& shortage, Instant now) {
  const Expected<Place> in_empty_lab = place(job, Room::empty_lab);
  if (nodes_.empty() || in_empty_lab) {
    job.hopeless_since.reset();
    job.reason = nodes_.empty() ? "waits for a node: none is there"
                                : "waits for draining nodes, or for memory other programs use: " + shortage.message;
    return;
  }
  std::string why = in_empty_lab.error().message;
  for (const auto& [node, reason] : job.unsuited) why += "; " + nodes_.at(node).facts.name + ": " + reason;
  if (!job.hopeless_since) job.hopeless_since = now;
  if (now >= *job.hopeless_since + options_.patience)
    return end(id, job, JobState::failed, "the lab can not hold it: " + why);
  job.reason = "waits for more nodes, the lab can not hold it: " + why;
}

Expected<Dispatcher::Place> Dispatcher::place(const LabJob& job, Room room) const {
  const std::vector<Seat> all = seats(job, room);
  Place place;
  if (job.pass == Pass::radiosity) {
    auto nodes = cells_on_nodes(options_.heuristic, cells_of(job.wish), all);
    if (!nodes) return nodes.error();
    place.nodes_of_cells = *std::move(nodes);
  } else {
    auto workers = workers_on_nodes(worker_bytes(job.wish), all);
    if (!workers) return workers.error();
    place.workers = *std::move(workers);
  }
  return place;
}

/// The nodes a job may use. What it books itself counts as free: it would move.
std::vector<Seat> Dispatcher::seats(const LabJob& job, Room room) const {
  std::map<NodeId, std::uint64_t> booked;
  std::map<NodeId, double> load;
  for (const auto& [id, other] : jobs_) {
    if (room != Room::now || &other == &job || !other.run) continue;
    for (const auto& [node, share] : other.run->shares) booked[node] += share.bytes;
    for (std::size_t cell = 0; cell < other.run->nodes_of_cells.size(); ++cell)
      load[other.run->nodes_of_cells[cell]] += other.wish.patches[cell];
  }
  double slowest = 0;
  for (const auto& [id, node] : nodes_)
    if (node.facts.rays_per_s > 0 && (slowest == 0 || node.facts.rays_per_s < slowest)) slowest = node.facts.rays_per_s;
  if (slowest == 0) slowest = 1;

  std::vector<Seat> seats;
  for (const auto& [id, node] : nodes_) {
    if (job.unsuited.contains(id) || (node.draining && room != Room::empty_lab)) continue;
    Seat seat;
    seat.node = id;
    seat.cores = std::max(1u, node.facts.cores);
    seat.speed = seat.cores * (node.facts.rays_per_s > 0 ? node.facts.rays_per_s : slowest) * node.pace.factor();
    const std::uint64_t taken = booked[id] + (room == Room::empty_lab ? 0 : node.foreign_bytes);
    seat.free_bytes = node.facts.memory_bytes - std::min(node.facts.memory_bytes, taken);
    seat.load = load[id];
    seats.push_back(seat);
  }
  return seats;
}

void Dispatcher::host(JobId id, LabJob& job, Place place, Instant now) {
  MUST(!job.run);
  job.epoch = Epoch{job.epoch.value + 1};
  due_.records.push_back(journal::EpochBegun{id, job.epoch});
  HostRun order{id, job.epoch, job.pass, job.pass == Pass::radiosity && job.has_checkpoint, {}, {}};
  HostedPass run;
  run.epoch = job.epoch;
  run.pass = job.pass;
  run.hosted_at = now;
  run.nodes_of_cells = std::move(place.nodes_of_cells);
  std::map<NodeId, std::vector<CellId>> cells;
  for (std::uint32_t cell = 0; cell < run.nodes_of_cells.size(); ++cell) {
    const NodeId node = run.nodes_of_cells[cell];
    Share& share = run.shares[node];
    share.bytes += job.wish.patches[cell] * job.wish.bytes_per_patch + (cells[node].empty() ? job.wish.base_bytes : 0);
    cells[node].push_back(CellId{cell});
  }
  order.cells.assign(cells.begin(), cells.end());
  for (const auto& [node, threads] : place.workers) run.shares[node].bytes = worker_bytes(job.wish);
  order.workers = std::move(place.workers);
  for (auto& [node, share] : run.shares) share.due = now + options_.hosting_lease;
  job.run = std::move(run);
  job.state = JobState::running;
  job.reason.clear();
  job.hopeless_since.reset();
  due_.orders.push_back(std::move(order));
}

void Dispatcher::begin(JobId id, LabJob& job, Instant now) {
  HostedPass& run = *job.run;
  if (run.begun) return;
  bool somebody_is_ready = false, is_awaited = false;
  for (const auto& [node, share] : run.shares) {
    is_awaited = is_awaited || share.awaited;
    somebody_is_ready = somebody_is_ready || share.hosted;
  }
  if (!somebody_is_ready) run.begin_at.reset();
  // Cells need each other; ray workers do not, and one that hangs while it is hosted shall not keep the others idle.
  const bool is_time = run.pass == Pass::picture && run.begin_at && now >= *run.begin_at;
  if (!somebody_is_ready || (is_awaited && !is_time)) return;
  run.begun = true;
  if (run.pass == Pass::radiosity) run.checkpoint_at = now + options_.checkpoint_every;
  due_.orders.push_back(BeginPass{id, run.epoch, run.pass});
}

// ---- Moving -----------------------------------------------------------------------------------------------------------

void Dispatcher::ask_for_checkpoint(JobId id, LabJob& job, Instant now) {
  if (!job.run->checkpoint_at || now < *job.run->checkpoint_at) return;
  job.run->checkpoint_at.reset();
  job.run->checkpoint_due = now + options_.checkpoint_lease;
  due_.orders.push_back(TakeCheckpoint{id, job.run->epoch});
}

/// Right after a checkpoint nothing is lost by hosting anew: away from draining and slow nodes, or onto nodes that lie idle.
void Dispatcher::move_cells(JobId id, LabJob& job, Instant now) {
  if (!std::exchange(job.run->may_move, false)) return;
  const auto is_draining = [&](const auto& share) { return nodes_.at(share.first).draining; };
  const auto is_slow = [&](const auto& share) { return nodes_.at(share.first).pace.is_slow(); };
  const auto& shares = job.run->shares;
  const bool has_to = std::any_of(shares.begin(), shares.end(), is_draining);
  const std::vector<Seat> all = seats(job, Room::now);
  const bool might_gain = shares.size() < std::min(job.wish.patches.size(), all.size()) ||
                          std::any_of(shares.begin(), shares.end(), is_slow);
  // On a busy machine nodes seem slow by turns: who has moved often moves rarely.
  const std::int64_t settling_ns = job.moves == 0 ? 0 : options_.settling.ns << std::min(job.moves - 1, 10u);
  const bool has_settled = now >= job.run->hosted_at + Duration{settling_ns};
  if (!has_to && !(might_gain && has_settled)) return;
  Expected<Place> found = place(job, Room::now);
  if (!found) return;
  const CellsToPlace cells = cells_of(job.wish);
  if (!has_to && finishing_time(cells, all, found->nodes_of_cells) >
                     worth_moving * finishing_time(cells, all, job.run->nodes_of_cells))
    return;
  if (!has_to) ++job.moves;
  requeue(id, job, {});
  host(id, job, *std::move(found), now);
}

/// Ray workers leave draining nodes once others are at work, and come to every node that has room.
void Dispatcher::move_workers(JobId id, LabJob& job, bool is_memory_wanted, Instant now) {
  auto& shares = job.run->shares;
  const bool others_work = std::any_of(shares.begin(), shares.end(), [&](const auto& share) {
    return share.second.hosted && !nodes_.at(share.first).draining;
  });
  for (auto share = shares.begin(); share != shares.end();) {
    const bool leaves = others_work && nodes_.at(share->first).draining;
    if (leaves) {
      due_.orders.push_back(ReleaseRun{id, job.run->epoch, share->first});
      job.run->sent_away.insert(share->first);
    }
    share = leaves ? shares.erase(share) : std::next(share);
  }
  if (is_memory_wanted) return;
  const Expected<Place> found = place(job, Room::now);
  if (!found) return;
  HostRun order{id, job.run->epoch, Pass::picture, false, {}, {}};
  for (const auto& worker : found->workers)
    if (!job.run->sent_away.contains(worker.first) &&
        shares.emplace(worker.first, Share{worker_bytes(job.wish), false, false, now + options_.hosting_lease}).second)
      order.workers.push_back(worker);
  if (!order.workers.empty()) due_.orders.push_back(std::move(order));
}

void Dispatcher::look_for_drained() {
  std::set<NodeId> in_use;
  for (const auto& [id, job] : jobs_)
    if (job.run)
      for (const auto& [node, share] : job.run->shares) in_use.insert(node);
  for (auto& [id, node] : nodes_) {
    if (!node.draining || node.drained || in_use.contains(id)) continue;
    node.drained = true;
    due_.orders.push_back(NodeDrained{id});
  }
}

std::optional<Instant> Dispatcher::next_wake() const {
  std::optional<Instant> earliest;
  for (const auto& [id, node] : nodes_) keep_earliest(earliest, node.heard + options_.lease);
  for (const auto& [id, job] : jobs_) {
    if (job.run) {
      if (job.run->checkpoint_at) keep_earliest(earliest, *job.run->checkpoint_at);
      if (job.run->checkpoint_due) keep_earliest(earliest, *job.run->checkpoint_due);
      if (job.run->pass == Pass::picture && !job.run->begun && job.run->begin_at)
        keep_earliest(earliest, *job.run->begin_at);
      for (const auto& [node, share] : job.run->shares)
        if (!share.hosted) keep_earliest(earliest, share.due);
    }
    if (job.hopeless_since) keep_earliest(earliest, *job.hopeless_since + options_.patience);
  }
  return earliest;
}

}  // namespace lichthof
