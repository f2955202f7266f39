#include "sim/lab_oracle.hpp"

namespace lichthof::sim {

namespace {
std::string name(JobId job) { return "job " + std::to_string(job.value); }
std::string name(NodeId node) { return "node " + std::to_string(node.value); }
}  // namespace

void LabOracle::ordered(const Order& order, const Dispatcher& dispatcher) {
  if (const auto* host = std::get_if<HostRun>(&order)) {
    if (!dispatcher.jobs().contains(host->job)) return complain("an order for an unknown " + name(host->job));
    hosting(*host, dispatcher.jobs().at(host->job).wish);
  } else if (const auto* ended = std::get_if<JobEnded>(&order)) {
    Seen& seen = jobs_[ended->job];
    if (seen.ended) complain(name(ended->job) + " ended twice");
    seen.ended = true;
    const LabJob& job = dispatcher.jobs().at(ended->job);
    if (ended->state != job.state || !has_ended(job.state)) complain(name(ended->job) + " ended in no end");
    if (ended->state == JobState::done && ((job.wish.radiosity && !seen.passes_done.contains(Pass::radiosity)) ||
                                           (job.wish.picture && !seen.passes_done.contains(Pass::picture))))
      complain(name(ended->job) + " is called done and is not");
  }
}

void LabOracle::hosting(const HostRun& order, const JobWish& wish) {
  Seen& seen = jobs_[order.job];
  if (seen.ended) complain(name(order.job) + " is hosted after its end");
  const bool is_more = order.epoch == seen.epoch && order.pass == Pass::picture;
  if (order.epoch < seen.epoch || (order.epoch == seen.epoch && !is_more))
    complain(name(order.job) + ": an epoch does not grow");
  if (!is_more) seen.hosts.clear();
  seen.epoch = order.epoch;
  std::set<CellId> cells;
  std::size_t count = 0;
  for (const auto& [node, hosted] : order.cells) {
    count += hosted.size();
    cells.insert(hosted.begin(), hosted.end());
  }
  const std::size_t expected = order.pass == Pass::radiosity ? wish.patches.size() : 0;
  if (count != expected || cells.size() != expected) complain(name(order.job) + ": not every cell is hosted once");
  if ((order.pass == Pass::picture) == order.workers.empty()) complain(name(order.job) + ": workers of no picture");
  for (const auto& [node, threads] : order.workers)
    if (threads == 0) complain(name(order.job) + ": a worker without threads");
}

void LabOracle::began(const BeginPass& order, NodeId node, bool holds) {
  if (!holds) complain(name(order.job) + " began although " + name(node) + " does not host its share");
}

void LabOracle::restarted() {
  for (auto& [id, seen] : jobs_) seen.moves = 0, seen.moved_at.reset();
}

void LabOracle::look_at_waiting(JobId id, const LabJob& job, const DispatcherOptions& options, Instant now) {
  Seen& seen = jobs_[id];
  if (job.moves != seen.moves) {
    if (seen.moved_at && now < *seen.moved_at + options.settling) complain(name(id) + " moves before it has settled");
    seen.moves = job.moves;
    seen.moved_at = now;
  }
  if (!job.run) return;
  for (const auto& [node, share] : job.run->shares)
    if (!share.hosted && now >= share.due) complain(name(id) + " waits for ever for " + name(node));
  if (job.run->checkpoint_due && now >= *job.run->checkpoint_due) complain(name(id) + " waits for ever for light");
  if (job.run->pass == Pass::picture && !job.run->begun && job.run->begin_at && now >= *job.run->begin_at)
    complain(name(id) + " keeps idle who could trace its picture");
}

void LabOracle::look(const Dispatcher& dispatcher, bool controller_is_up, Instant now) {
  if (!controller_is_up) return;
  for (const auto& [id, seen] : jobs_)
    if (!dispatcher.jobs().contains(id)) complain(name(id) + " was accepted and is lost");
  for (const auto& [id, job] : dispatcher.jobs()) {
    if (job.run.has_value() != (job.state == JobState::running)) complain(name(id) + " runs without a run");
    if (has_ended(job.state) != jobs_[id].ended) complain(name(id) + " has ended and nobody was told");
    if (job.state == JobState::queued && job.reason.empty()) complain(name(id) + " waits for no reason");
    look_at_waiting(id, job, dispatcher.options(), now);
    if (!job.run) continue;
    if (job.run->epoch != job.epoch || job.run->shares.empty()) complain(name(id) + " runs nowhere");
    for (const auto& [node, share] : job.run->shares)
      if (!dispatcher.nodes().contains(node)) complain(name(id) + " counts on a lost node");
  }
  for (const auto& [id, node] : dispatcher.nodes())
    if (dispatcher.booked_bytes(id) > node.facts.memory_bytes) complain(name(id) + " is booked beyond its memory");
}

void LabOracle::look(NodeId id, const ModelNode& node, std::uint64_t memory_bytes) {
  if (node.used_bytes() > memory_bytes) complain(name(id) + " hosts more than its memory");
  for (const auto& [key, share] : node.shares)
    for (const auto& [cell, rest] : share.rest)
      if (!seen_cells_.emplace(key, cell).second) complain(name(key.first) + ": a cell is hosted twice in one epoch");
}

}  // namespace lichthof::sim
