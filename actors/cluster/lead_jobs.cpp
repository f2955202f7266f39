/// The lead's jobs: what people ask for, the dispatcher's orders carried out, and the passes under way.
#include <spdlog/spdlog.h>

#include <bit>
#include <filesystem>

#include "actors/cluster/kept_light.hpp"
#include "actors/cluster/lead_state.hpp"
#include "actors/codec.hpp"

namespace lichthof::actors {

namespace {

/// What the light of a first pass cost on its way between cells.
std::string traffic_of(const SolveCounters& c) {
  const auto each = [&](std::uint64_t count) { return std::to_string(count > 0 ? c.bytes_sent / count : 0); };
  return "the first pass took " + std::to_string(c.shots) + " shots, " + std::to_string(c.messages) + " messages and " +
         std::to_string(c.bytes_sent) + " bytes between cells: " + each(c.shots) + " bytes per shot, " +
         each(c.messages) + " per message";
}

}  // namespace

// ---- What people ask for ----

Expected<JobId> LeadState::submit(const JobOrder& order) {
  if (!blobs_->find(order.solution)) return Error{ErrorCode::bad_input, "scene", "has not been handed in"};
  const bool is_full = forget_old();
  Expected<JobId> id =
      is_full ? Expected<JobId>(Error{ErrorCode::failed, "the lab",
                                      "keeps as many results that nobody has fetched as it may; fetch some, then hand it "
                                      "in again"})
              : dispatcher_.submit(order.wish, clock_.now());
  if (!id) {
    stale_.insert(order.solution);
    drop_stale();
    return id.error();
  }
  jobs_[*id].kept = {order, order.solution, unix_s(), 0, false};
  say(*id, "submitted by " + order.owner);
  if (Status kept = decide(); !kept) return kept.error();
  return id;
}

Status LeadState::cancel(JobId job) { return decided(dispatcher_.cancel(job, clock_.now())); }

Status LeadState::retry(JobId job) {
  Status status = dispatcher_.retry(job, clock_.now());
  if (status) jobs_[job].kept.ended_s = 0, jobs_[job].kept.is_fetched = false;
  return decided(std::move(status));
}

void LeadState::fetched(JobId id) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end() || found->second.kept.is_fetched) return;
  found->second.kept.is_fetched = true;
  if (Status kept = keep(); !kept) spdlog::error("{}", kept.error().text());
}

Expected<Image> LeadState::picture(JobId id) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return Error{ErrorCode::bad_input, "job " + std::to_string(id.value), "there is none"};
  if (found->second.run && found->second.run->balancer()) return found->second.run->balancer()->image();
  return Error{ErrorCode::failed, "job " + std::to_string(id.value), "has no picture yet"};
}

// ---- Deciding ----

Status LeadState::decided(Status status) {
  if (!status) return status;
  return decide();
}

Status LeadState::decide() {
  const Instant now = clock_.now();
  while (dispatcher_.has_work(now)) {
    Dispatched due = dispatcher_.step(now);
    if (!due.records.empty())
      if (Status kept = keep(); !kept) {
        spdlog::error("{}", kept.error().text());
        return kept;
      }
    for (const Order& order : due.orders) std::visit([this](const auto& one) { carry_out(one); }, order);
    if (due.orders.empty() && due.records.empty()) break;
  }
  return Done{};
}

Status LeadState::keep() {
  LeadFile file;
  file.journal = dispatcher_.summary();
  for (auto& [id, job] : jobs_) {
    const auto found = dispatcher_.jobs().find(id);
    if (found != dispatcher_.jobs().end() && has_ended(found->second.state) && job.kept.ended_s == 0)
      job.kept.ended_s = unix_s();
    file.jobs[id] = job.kept;
  }
  return write_lead_file(options_.folder + "/jobs", file);
}

// ---- Orders ----

void LeadState::carry_out(const HostRun& order) {
  Job& job = jobs_[order.job];
  const bool is_new = !job.run || job.run->epoch() != order.epoch;
  if (is_new) {
    job.run = std::make_unique<RunLead>(order, job.kept.order.picture, job.kept.order.eps,
                                        [this](NodeId node, const ClusterMessage& message) { to_node(node, message); });
    const bool is_first = order.pass == Pass::radiosity && !order.from_checkpoint;
    job.begun_with = is_first ? job.kept.order.solution : job.kept.solution;
    if (order.pass == Pass::picture) take_up_columns(order.job, job);
  }
  HostShare share{order.job, order.epoch, order.pass, job.begun_with, {}, {}, job.kept.order.picture, 0, 0};
  if (order.pass == Pass::radiosity) {
    std::size_t count = 0;
    for (const auto& [node, cells] : order.cells) count += cells.size();
    share.cells.resize(count);
    for (const auto& [node, cells] : order.cells) {
      share.peers.push_back(nodes_[node].peer);
      for (const CellId cell : cells) share.cells.at(cell.value) = node;
    }
    for (const auto& [node, cells] : order.cells) {
      share.bytes = booked(order.job, node);
      to_node(node, share);
    }
    say(order.job, "epoch " + std::to_string(order.epoch.value) + ": cells go to " + names(order.cells));
    return;
  }
  for (const auto& [node, range] : job.run->add_workers(order)) {
    share.first_worker = range.first, share.workers = range.second;
    share.bytes = booked(order.job, node);
    to_node(node, share);
  }
  say(order.job, "epoch " + std::to_string(order.epoch.value) + ": the picture is traced by " + names(order.workers));
}

void LeadState::carry_out(const BeginPass& order) {
  if (RunLead* const run = run_at(order.job, order.epoch)) {
    run->begin(clock_.now());
    look_at(*run);
  }
}

void LeadState::carry_out(const ReleaseRun& order) {
  Job& job = jobs_[order.job];
  for (const auto& [node, known] : nodes_)
    if (!order.node || *order.node == node) to_node(node, ReleaseShare{order.job, order.epoch});
  if (!job.run || job.run->epoch() != order.epoch) return;
  if (order.node) return job.run->lose_workers(*order.node, clock_.now());
  keep_columns(order.job, job);
  job.columns.reset();
  job.run.reset();
}

void LeadState::carry_out(const TakeCheckpoint& order) {
  if (RunLead* const run = run_at(order.job, order.epoch)) {
    run->take_checkpoint(clock_.now());
    look_at(*run);
  }
}

void LeadState::carry_out(const JobEnded& order) {
  jobs_[order.job].bytes = 0;
  std::error_code error;
  if (order.state == JobState::done) std::filesystem::remove(columns_path(order.job), error);
  say(order.job, std::string(name_of(order.state)) + (order.reason.empty() ? "" : ": " + order.reason));
}

// ---- Passes ----

RunLead* LeadState::run_at(JobId id, Epoch epoch) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end() || !found->second.run || found->second.run->epoch() != epoch) return nullptr;
  return found->second.run.get();
}

std::uint64_t LeadState::booked(JobId id, NodeId node) const {
  const auto job = dispatcher_.jobs().find(id);
  if (job == dispatcher_.jobs().end() || !job->second.run) return 0;
  const auto share = job->second.run->shares.find(node);
  return share == job->second.run->shares.end() ? 0 : share->second.bytes;
}

void LeadState::look_at(RunLead& run) {
  const RunLead::Wants wants = run.due();
  if (wants == RunLead::Wants::nothing) return;
  Job& job = jobs_[run.job()];
  if (run.pass() == Pass::picture) {
    const Status written = options_.write_picture(result_path(run.job()), run.balancer()->image());
    if (written)
      dispatcher_.pass_finished(run.job(), run.epoch(), clock_.now());
    else
      dispatcher_.pass_failed(run.job(), run.epoch(), written.error().text(), clock_.now());
    return;
  }
  // On a thread of its own: reading and writing take seconds.
  const caf::actor lead = caf::actor_cast<caf::actor>(self_);
  KeptLight light;
  light.job = run.job(), light.epoch = run.epoch();
  light.is_end = wants == RunLead::Wants::end;
  light.sequence = ++last_writing_;
  ++job.writings;
  self_->system().spawn<caf::detached>(
      [lead, light, base = blobs_->find(job.begun_with),
       images = std::make_shared<std::map<CellId, CellImage>>(run.take_images(clock_.now())), options = options_,
       blobs = blobs_](caf::event_based_actor* writer) mutable {
        keep_light(light, base, *images, options, *blobs);
        writer->send(lead, std::move(light));
      });
}

/// The picture begins without the columns that an earlier epoch has finished.
void LeadState::take_up_columns(JobId id, Job& job) {
  const PictureSpec& spec = job.kept.order.picture;
  std::string key = options_.link.version + ' ' + job.begun_with;
  for (const std::uint32_t number :
       {std::uint32_t{spec.method}, spec.width, spec.height, spec.samples, spec.gather_rays})
    key += ' ' + std::to_string(number);
  for (const double number : spec.camera) key += ' ' + std::to_string(std::bit_cast<std::uint64_t>(number));
  Expected<KeptColumns> kept = KeptColumns::open(columns_path(id), key, spec.width, spec.height);
  if (!kept) return say(id, "its columns can not be kept: " + kept.error().text());
  job.columns = std::move(*kept);
  std::vector<ColumnResult> found = job.columns->take();
  if (found.empty()) return;
  say(id, std::to_string(found.size()) + " columns are there already");
  job.run->restore(std::move(found), clock_.now());
}

void LeadState::keep_columns(JobId id, Job& job) {
  const Balancer* const balancer = job.run ? job.run->balancer() : nullptr;
  if (!balancer || !job.columns) return;
  for (std::uint32_t column = 0; column < balancer->image().width(); ++column) {
    if (!balancer->is_finished(column) || job.columns->has(column)) continue;
    const Status added = job.columns->add(column, balancer->image().column(column), balancer->rays(column));
    if (added) continue;
    say(id, "its columns can not be kept: " + added.error().text());
    return job.columns.reset();
  }
}

void LeadState::on(KeptLight& light) {
  const auto found = jobs_.find(light.job);
  if (found == jobs_.end()) return;
  Job& job = found->second;
  --job.writings;
  if (!run_at(light.job, light.epoch)) return;
  if (light.sequence < job.written) return;
  job.written = light.sequence;
  if (light.hash.empty()) {
    say(light.job, "the light can not be kept: " + light.reason);
    if (light.is_end)
      dispatcher_.pass_failed(light.job, light.epoch, light.reason, clock_.now());
    else
      dispatcher_.checkpoint_failed(light.job, light.epoch, clock_.now());
  } else {
    const std::string before = std::exchange(job.kept.solution, light.hash);
    if (before != job.begun_with) stale_.insert(before);
    job.energy = light.energy, job.counters = light.counters;
    say(light.job, "kept the light of " + std::to_string(light.counters.shots) + " shots");
    if (light.is_end) say(light.job, traffic_of(light.counters));
    if (light.is_end)
      dispatcher_.pass_finished(light.job, light.epoch, clock_.now());
    else
      dispatcher_.checkpoint_kept(light.job, light.epoch, clock_.now());
  }
  if (decide()) drop_stale();  // not while the file still names it
}

/// Checkpoints that newer ones have replaced. What a job began with stays: another job may begin with the same.
void LeadState::drop_stale() {
  for (const auto& [id, job] : jobs_)
    for (const std::string& used : {job.kept.solution, job.kept.order.solution, job.begun_with}) stale_.erase(used);
  for (const std::string& hash : stale_) blobs_->remove(hash);
  stale_.clear();
}

bool LeadState::forget_old() {
  std::vector<EndedJob> ended;
  for (const auto& [id, lab_job] : dispatcher_.jobs()) {
    if (!has_ended(lab_job.state)) continue;
    Job& job = jobs_[id];
    if (job.bytes == 0) job.bytes = bytes_on_disk(id, job);
    const bool is_wanted = !job.kept.is_fetched && lab_job.state != JobState::cancelled;
    ended.push_back({id, job.kept.ended_s, is_wanted, job.bytes});
  }
  const Retention due = retention(std::move(ended), options_.retention, unix_s());
  std::error_code error;
  for (const JobId id : due.forgotten) {
    if (!dispatcher_.forget(id)) continue;
    spdlog::info("job {} is forgotten", id.value);
    for (const std::string& blob : {jobs_[id].kept.solution, jobs_[id].kept.order.solution, jobs_[id].begun_with})
      if (!blob.empty()) stale_.insert(blob);
    jobs_.erase(id);
    for (const std::string& path : {result_path(id), columns_path(id)}) std::filesystem::remove(path, error);
    if (options_.forgotten) options_.forgotten(id);
  }
  // Files go once nothing that is written down names them.
  if (!due.forgotten.empty() && decide()) drop_stale();
  return due.is_full;
}

std::uint64_t LeadState::bytes_on_disk(JobId id, const Job& job) const {
  std::uint64_t bytes = 1;  // a job costs something, and is not looked at again
  std::error_code error;
  for (const std::string& path : {result_path(id), columns_path(id), blobs_->path(job.kept.solution)})
    if (const auto size = std::filesystem::file_size(path, error); !error) bytes += size;
  return bytes;
}

void LeadState::say(JobId job, const std::string& line) {
  spdlog::info("job {}: {}", job.value, line);
  if (options_.log) options_.log(job, line);
}

}  // namespace lichthof::actors
