#include "core/cluster/dispatcher.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

std::string seconds(Duration duration) { return std::to_string(duration.ns / 1'000'000'000) + " s"; }

Error unknown(const std::string& what, std::uint64_t id) {
  return {ErrorCode::bad_input, what + " " + std::to_string(id), "is not known here"};
}

}  // namespace

// ---- Nodes ------------------------------------------------------------------------------------------------------------

void Dispatcher::node_joined(NodeId node, const NodeFacts& facts, Instant now) {
  // Its old link broke before we heard of it.
  if (nodes_.contains(node)) lose(node, "joined anew", true, now);
  LabNode& joined = nodes_[node];
  joined.facts = facts;
  if (!std::isfinite(facts.rays_per_s) || facts.rays_per_s < 0) joined.facts.rays_per_s = 0;
  joined.heard = now;
  joined.draining = draining_.contains(facts.name);
  is_changed_ = true;
}

void Dispatcher::node_reported(NodeId node, std::uint64_t free_memory_bytes, Instant now) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  found->second.heard = now;
  // What neither is free nor was booked and taken by our runs belongs to others. It is reckoned now and kept: a run that
  // is released later frees its share at once.
  std::uint64_t ours = 0;
  for (const auto& [id, job] : jobs_)
    if (job.run)
      if (const auto share = job.run->shares.find(node); share != job.run->shares.end() && share->second.hosted)
        ours += share->second.bytes;
  const std::uint64_t memory = found->second.facts.memory_bytes;
  const std::uint64_t used = memory - std::min(memory, free_memory_bytes);
  const std::uint64_t foreign = used - std::min(used, ours);
  is_changed_ = is_changed_ || foreign != found->second.foreign_bytes;
  found->second.foreign_bytes = foreign;
}

void Dispatcher::node_paced(NodeId node, double share, Instant now) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  std::set<NodeId> at_work;
  for (const auto& [id, job] : jobs_)
    if (job.run)
      for (const auto& [other, hosted] : job.run->shares)
        if (other != node && hosted.hosted) at_work.insert(other);
  std::vector<double> others;
  for (const NodeId other : at_work) others.push_back(nodes_.at(other).pace.share());
  std::sort(others.begin(), others.end());
  const double usual = others.empty() ? 1 : others[others.size() / 2];
  if (!found->second.pace.measured(share, usual, options_.pace, now)) return;
  is_changed_ = true;
  if (!found->second.pace.is_slow()) return;
  // The sooner its cells leave the better.
  for (auto& [id, job] : jobs_)
    if (job.run && job.run->checkpoint_at && job.run->shares.contains(node)) job.run->checkpoint_at = now;
}

void Dispatcher::node_left(NodeId node, const std::string& reason, Instant now) {
  if (nodes_.contains(node)) lose(node, reason, true, now);
}

void Dispatcher::node_parted(NodeId node, const std::string& reason, Instant now) {
  if (nodes_.contains(node)) lose(node, reason, false, now);
}

Status Dispatcher::drain(NodeId node, bool is_draining, Instant) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return unknown("node", node.value);
  return drain(found->second.facts.name, is_draining);
}

Status Dispatcher::drain(const std::string& name, bool is_draining) {
  const auto is_named = [&](const auto& node) { return node.second.facts.name == name; };
  const bool is_here = std::any_of(nodes_.begin(), nodes_.end(), is_named);
  if (!is_here && (is_draining || !draining_.contains(name)))
    return Error{ErrorCode::bad_input, "node " + name, "is not known here"};
  if (draining_.contains(name) == is_draining) return Done{};
  if (is_draining)
    draining_.insert(name);
  else
    draining_.erase(name);
  due_.records.push_back(journal::Draining{name, is_draining});
  for (auto& [id, node] : nodes_)
    if (node.facts.name == name) node.draining = is_draining, node.drained = false;
  is_changed_ = true;
  return Done{};
}

Status Dispatcher::kick(NodeId node, Instant now) {
  if (!nodes_.contains(node)) return unknown("node", node.value);
  due_.orders.push_back(DropNode{node, "kicked"});
  lose(node, "kicked", false, now);
  return Done{};
}

void Dispatcher::lose(NodeId node, const std::string& reason, bool counts, Instant now) {
  for (auto& [id, job] : jobs_) {
    job.unsuited.erase(node);
    if (job.run) job.run->sent_away.erase(node);
    if (job.run && job.run->shares.contains(node)) lose_share(id, job, node, reason, counts, now);
  }
  nodes_.erase(node);
  is_changed_ = true;
}

void Dispatcher::lose_share(JobId id, LabJob& job, NodeId node, const std::string& reason, bool counts, Instant now) {
  const std::string name = nodes_.at(node).facts.name;
  const bool is_one_more = !job.lost_at || now >= *job.lost_at + options_.lost_together;
  if (counts && is_one_more) {
    job.lost_at = now;
    job.lost_nodes.push_back(name);
    due_.records.push_back(journal::NodeLost{id, name});
    if (job.lost_nodes.size() >= options_.most_node_kills) {
      std::string names;
      for (const std::string& lost : job.lost_nodes) names += " " + lost;
      return end(id, job, JobState::failed,
                 "lost " + std::to_string(job.lost_nodes.size()) + " nodes while running:" + names);
    }
  }
  job.run->shares.erase(node);
  if (job.run->pass == Pass::radiosity || job.run->shares.empty())
    requeue(id, job, "lost node " + name + " (" + reason + ")");
}

void Dispatcher::expire_leases(Instant now) {
  // Who was not stepped when it asked to be has heard nobody: the silence was its own.
  const bool was_asleep = promised_at_ && now > *promised_at_ + options_.lease;
  if (was_asleep)
    for (auto& [id, job] : jobs_)
      if (job.run) {
        for (auto& [node, share] : job.run->shares) share.due = now + options_.hosting_lease;
        if (job.run->checkpoint_due) job.run->checkpoint_due = now + options_.checkpoint_lease;
      }
  std::vector<NodeId> silent;
  for (auto& [id, node] : nodes_) {
    if (was_asleep) node.heard = now;
    if (now >= node.heard + options_.lease) silent.push_back(id);
  }
  const std::string reason = "silent for " + seconds(options_.lease);
  for (const NodeId node : silent) {
    due_.orders.push_back(DropNode{node, reason});
    lose(node, reason, true, now);
  }
}

/// Orders that were not answered in their time.
void Dispatcher::expire_orders(Instant now) {
  for (auto& [id, job] : jobs_) {
    if (!job.run) continue;
    std::vector<NodeId> late;
    for (const auto& [node, share] : job.run->shares)
      if (!share.hosted && now >= share.due) late.push_back(node);
    const Epoch epoch = job.run->epoch;
    for (const NodeId node : late) {
      if (!job.run) break;
      if (job.run->pass == Pass::picture) due_.orders.push_back(ReleaseRun{id, epoch, node});
      host_failed(node, id, epoch, "did not host it within " + seconds(options_.hosting_lease), nodes_.at(node).heard);
    }
    if (!job.run || !job.run->checkpoint_due || now < *job.run->checkpoint_due) continue;
    const std::string reason = "its cells answered no checkpoint within " + seconds(options_.checkpoint_lease);
    if (++job.stuck >= options_.most_stuck)
      end(id, job, JobState::failed, reason + ", " + std::to_string(job.stuck) + " times in a row");
    else
      requeue(id, job, reason);
  }
}

// ---- Jobs -------------------------------------------------------------------------------------------------------------

Expected<JobId> Dispatcher::submit(const JobWish& wish, Instant) {
  if (const Status can_be = plausible(wish); !can_be) return can_be.error();
  const auto waits = [](const auto& job) { return job.second.state == JobState::queued; };
  if (std::count_if(jobs_.begin(), jobs_.end(), waits) >= std::int64_t{options_.most_waiting_jobs})
    return Error{ErrorCode::failed, "queue",
                 "is full: " + std::to_string(options_.most_waiting_jobs) +
                     " jobs wait; hand it in again when some have ended, or cancel some"};
  const JobId id{++last_job_};
  LabJob& job = jobs_[id];
  job.wish = wish;
  job.pass = wish.radiosity ? Pass::radiosity : Pass::picture;
  due_.records.push_back(journal::Submitted{id, wish});
  is_changed_ = true;
  return id;
}

Status Dispatcher::cancel(JobId id, Instant) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown("job", id.value);
  if (has_ended(found->second.state))
    return Error{ErrorCode::bad_input, "job " + std::to_string(id.value), "has ended already"};
  end(id, found->second, JobState::cancelled, "cancelled");
  return Done{};
}

Status Dispatcher::retry(JobId id, Instant) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown("job", id.value);
  LabJob& job = found->second;
  if (job.state != JobState::failed && job.state != JobState::cancelled)
    return Error{ErrorCode::bad_input, "job " + std::to_string(id.value), "has neither failed nor been cancelled"};
  job.state = JobState::queued;
  job.reason.clear();
  job.lost_nodes.clear();
  job.lost_at.reset();
  job.unsuited.clear();
  job.stuck = 0;
  due_.records.push_back(journal::Retried{id});
  is_changed_ = true;
  return Done{};
}

Status Dispatcher::forget(JobId id) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return unknown("job", id.value);
  if (!has_ended(found->second.state))
    return Error{ErrorCode::failed, "job " + std::to_string(id.value), "has not ended"};
  jobs_.erase(found);
  due_.records.push_back(journal::Forgotten{id});
  return Done{};
}

/// What a run has left behind is released; the job has none any more.
void Dispatcher::release(JobId id, LabJob& job) {
  if (job.run) due_.orders.push_back(ReleaseRun{id, job.run->epoch, std::nullopt});
  job.run.reset();
  is_changed_ = true;
}

void Dispatcher::requeue(JobId id, LabJob& job, const std::string& reason) {
  release(id, job);
  job.state = JobState::queued;
  job.reason = reason;
}

void Dispatcher::end(JobId id, LabJob& job, JobState state, const std::string& reason) {
  MUST(!has_ended(job.state));
  release(id, job);
  job.state = state;
  job.reason = reason;
  job.hopeless_since.reset();
  due_.records.push_back(journal::Ended{id, state, reason});
  due_.orders.push_back(JobEnded{id, state, reason});
}

// ---- Runs -------------------------------------------------------------------------------------------------------------

/// The job, if this is its present epoch.
LabJob* Dispatcher::job_at(JobId job, Epoch epoch) {
  const auto found = jobs_.find(job);
  const bool is_present = found != jobs_.end() && found->second.run && found->second.run->epoch == epoch;
  return is_present ? &found->second : nullptr;
}

void Dispatcher::hosted(NodeId node, JobId id, Epoch epoch, Instant now) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) found->second.heard = now;
  LabJob* job = job_at(id, epoch);
  if (!job) return;
  const auto share = job->run->shares.find(node);
  if (share == job->run->shares.end()) return;
  share->second.hosted = true;
  share->second.awaited = false;
  if (!job->run->begin_at) job->run->begin_at = now + options_.gathering;
  is_changed_ = true;
}

void Dispatcher::still_hosting(NodeId node, JobId id, Epoch epoch, Instant now) {
  LabJob* job = job_at(id, epoch);
  if (!job) return;
  if (const auto share = job->run->shares.find(node); share != job->run->shares.end())
    share->second.due = now + options_.hosting_lease;
}

void Dispatcher::host_failed(NodeId node, JobId id, Epoch epoch, const std::string& reason, Instant now) {
  if (const auto found = nodes_.find(node); found != nodes_.end()) found->second.heard = now;
  LabJob* job = job_at(id, epoch);
  if (!job || !job->run->shares.contains(node)) return;
  job->unsuited[node] = reason;
  job->run->shares.erase(node);
  is_changed_ = true;
  if (job->run->pass == Pass::radiosity || job->run->shares.empty())
    requeue(id, *job, nodes_.at(node).facts.name + " could not host it: " + reason);
}

void Dispatcher::still_keeping(JobId id, Epoch epoch, Instant now) {
  if (LabJob* job = job_at(id, epoch); job && job->run->checkpoint_due)
    job->run->checkpoint_due = now + options_.checkpoint_lease;
}

void Dispatcher::checkpoint_kept(JobId id, Epoch epoch, Instant now) {
  LabJob* job = job_at(id, epoch);
  if (!job || !job->run->begun || job->run->pass != Pass::radiosity) return;
  due_.records.push_back(journal::CheckpointKept{id});  // each of them: what is written beside it names the light
  job->has_checkpoint = true;
  job->run->checkpoint_at = now + options_.checkpoint_every;
  job->run->checkpoint_due.reset();
  job->run->may_move = true;
  job->stuck = 0;
  is_changed_ = true;
}

void Dispatcher::checkpoint_failed(JobId id, Epoch epoch, Instant now) {
  LabJob* job = job_at(id, epoch);
  if (!job || !job->run->begun || job->run->pass != Pass::radiosity || job->run->checkpoint_at) return;
  job->run->checkpoint_at = now + options_.checkpoint_every;
  job->run->checkpoint_due.reset();
  is_changed_ = true;
}

void Dispatcher::pass_finished(JobId id, Epoch epoch, Instant) {
  LabJob* job = job_at(id, epoch);
  if (!job || !job->run->begun) return;
  const Pass pass = job->run->pass;
  due_.records.push_back(journal::PassFinished{id, pass});
  if (pass == Pass::picture || !job->wish.picture) return end(id, *job, JobState::done, {});
  requeue(id, *job, "waits for its picture");
  job->pass = Pass::picture;
}

void Dispatcher::pass_failed(JobId id, Epoch epoch, const std::string& reason, Instant) {
  if (LabJob* job = job_at(id, epoch)) end(id, *job, JobState::failed, reason);
}

// ---- Leading ----------------------------------------------------------------------------------------------------------

bool Dispatcher::has_work(Instant now) const {
  return is_changed_ || !due_.orders.empty() || !due_.records.empty() || (promised_at_ && now >= *promised_at_);
}

Dispatched Dispatcher::step(Instant now) {
  expire_leases(now);
  expire_orders(now);
  plan(now);
  is_changed_ = false;
  promised_at_ = next_wake();
  due_.wake_at = promised_at_;
  return std::exchange(due_, {});
}

std::uint64_t Dispatcher::booked_bytes(NodeId node) const {
  std::uint64_t sum = 0;
  for (const auto& [id, job] : jobs_)
    if (job.run)
      if (const auto share = job.run->shares.find(node); share != job.run->shares.end()) sum += share->second.bytes;
  return sum;
}

}  // namespace lichthof
