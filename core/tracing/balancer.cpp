#include "core/tracing/balancer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.hpp"

namespace lichthof {

namespace {
/// ⌊W · Ratio⌋, at least one column. The tiny addition keeps exact quotients exact.
std::uint32_t adaptive_size(std::uint32_t work_load, std::uint32_t workers, double time_ratio) {
  const double ratio = 1.0 / (1.0 + time_ratio * (workers - 1.0));
  return std::max(1u, static_cast<std::uint32_t>(std::floor(work_load * ratio + 1e-9)));
}
}  // namespace

Balancer::Balancer(const BalancerOptions& options)
    : options_(options), pool_{{0, options.columns}}, work_load_(options.columns), workers_(options.workers),
      first_round_left_(options.workers), is_finished_(options.columns, 0), column_rays_(options.columns, 0),
      image_(options.columns, options.height) {
  MUST(options.columns >= 1 && options.height >= 1 && options.workers >= 1);
  MUST(options.time_ratio >= 1.0 && options.boxes >= 1);
}

void Balancer::accept(const Envelope& envelope, Instant) { inbox_.push_back(envelope.message); }

Effects Balancer::step(Instant) {
  MUST(has_work());
  Effects effects;
  const Message message = std::move(inbox_.front());
  inbox_.pop_front();
  if (const auto* request = std::get_if<JobRequest>(&message))
    on(*request, effects);
  else if (const auto* result = std::get_if<ColumnResult>(&message))
    on(*result, effects);
  else if (const auto* lost = std::get_if<WorkerLost>(&message))
    on(*lost, effects);
  else
    effects.events.push_back(MessageRefused{});
  return effects;
}

void Balancer::on(const JobRequest& request, Effects& effects) {
  if (refused_.contains(request.worker)) return;
  if (known_.insert(request.worker).second && known_.size() > workers_)
    workers_ = static_cast<std::uint32_t>(known_.size());
  if (std::find(waiting_.begin(), waiting_.end(), request.worker) == waiting_.end()) waiting_.push_back(request.worker);
  serve_waiting(effects);
}

void Balancer::on(const ColumnResult& result, Effects& effects) {
  const ColumnJob job = result.job;
  const bool sound = job.first < job.last && job.last <= options_.columns &&
                     result.pixels.size() == std::size_t{job.size()} * options_.height &&
                     result.rays.size() == job.size();
  if (!sound || refused_.contains(result.worker)) {
    // A worker that sends nonsense gets no more work; its columns go to others.
    effects.events.push_back(MessageRefused{});
    refused_.insert(result.worker);
    on(WorkerLost{result.worker}, effects);
    return;
  }
  std::erase_if(assigned_, [&](const HandedOut& out) {
    return out.worker == result.worker && out.job.first >= job.first && out.job.last <= job.last;
  });

  // Columns that came before are left as they are: a result is the same whoever computed it.
  bool news = false;
  for (std::uint32_t column = job.first; column < job.last; ++column) {
    if (is_finished_[column]) continue;
    is_finished_[column] = 1;
    ++finished_columns_;
    news = true;
    column_rays_[column] = result.rays[column - job.first];
    rays_ += column_rays_[column];
    image_.set_columns(column,
                       {result.pixels.data() + std::size_t{column - job.first} * options_.height, options_.height});
  }
  if (!news) return;
  effects.events.push_back(JobFinished{result.worker, job.first, job.last});
  // A worker given up for lost may deliver after all: what it brings need not be done again.
  std::vector<ColumnJob> open;
  std::swap(open, pool_);
  work_load_ = 0;
  for (const ColumnJob& range : open) return_to_pool(range);
  if (finished()) serve_waiting(effects);
}

void Balancer::on(const WorkerLost& lost, Effects& effects) {
  if (known_.erase(lost.worker) && workers_ > 1) --workers_;
  std::erase(waiting_, lost.worker);
  take_back(lost.worker);
  serve_waiting(effects);
}

void Balancer::take_back(WorkerId worker) {
  std::vector<ColumnJob> left;
  for (const HandedOut& out : assigned_)
    if (out.worker == worker) left.push_back(out.job);
  std::erase_if(assigned_, [&](const HandedOut& out) { return out.worker == worker; });
  for (const ColumnJob& job : left) return_to_pool(job);
}

/// Those of its columns that are not finished, and that nobody else has.
void Balancer::return_to_pool(const ColumnJob& job) {
  const std::vector<std::uint8_t> held = holders();
  for (std::uint32_t column = job.first; column < job.last; ++column) {
    if (is_finished_[column] || held[column] > 0) continue;
    // The first range that ends at this column or later; grow it, or the one below it, or begin a new one.
    auto after = std::lower_bound(pool_.begin(), pool_.end(), column,
                                  [](const ColumnJob& range, std::uint32_t c) { return range.last < c; });
    if (after != pool_.end() && after->last == column) {
      after->last = column + 1;
      if (const auto next = after + 1; next != pool_.end() && next->first == column + 1) {
        after->last = next->last;
        pool_.erase(next);
      }
    } else if (after != pool_.end() && after->first == column + 1) {
      after->first = column;
    } else {
      pool_.insert(after, ColumnJob{column, column + 1});
    }
    ++work_load_;
  }
}

std::vector<std::uint8_t> Balancer::holders() const {
  std::vector<std::uint8_t> held(options_.columns, 0);
  for (const HandedOut& out : assigned_)
    for (std::uint32_t column = out.job.first; column < out.job.last; ++column)
      held[column] = static_cast<std::uint8_t>(std::min(held[column] + 1, 255));
  return held;
}

void Balancer::serve_waiting(Effects& effects) {
  for (const WorkerId worker : std::exchange(waiting_, {})) {
    if (finished()) {
      effects.outbox.push_back({ToBalancer{}, worker, JobAssignment{{}, true}});
    } else if (const ColumnJob job = work_load_ > 0 ? next_job() : second_run(worker); job.size() > 0) {
      assign(worker, job, effects);
    } else {
      waiting_.push_back(worker);
    }
  }
}

std::uint32_t Balancer::next_size() {
  if (options_.scheduling == Scheduling::boxes) return (options_.columns + options_.boxes - 1) / options_.boxes;
  // An interrupted picture has less left when its first round begins.
  const std::uint32_t size = adaptive_size(work_load_, workers_, options_.time_ratio);
  if (jobs_ == 0) first_round_size_ = size;
  return first_round_left_ > 0 ? first_round_size_ : size;
}

ColumnJob Balancer::next_job() {
  ColumnJob& range = pool_.front();
  const std::uint32_t size = std::min(next_size(), range.size());
  const ColumnJob job{range.first, range.first + size};
  range.first += size;
  if (range.size() == 0) pool_.erase(pool_.begin());
  work_load_ -= size;
  if (first_round_left_ > 0) --first_round_left_;
  return job;
}

/// What one other worker has, in a piece as small as if it were the rest of the picture; size 0: nothing.
ColumnJob Balancer::second_run(WorkerId worker) const {
  if (!options_.second_runs) return {};
  std::vector<std::uint8_t> held = holders();
  const auto is_open = [&](std::uint32_t column) { return held[column] == 1 && !is_finished_[column]; };
  for (const HandedOut& out : assigned_)
    if (out.worker == worker) std::fill(&held[out.job.first], &held[out.job.last - 1] + 1, std::uint8_t{0});
  std::uint32_t open = 0;
  for (std::uint32_t column = 0; column < options_.columns; ++column) open += is_open(column);
  const std::uint32_t most = adaptive_size(open, workers_, options_.time_ratio);
  for (const HandedOut& out : assigned_)
    for (std::uint32_t first = out.job.first; first < out.job.last; ++first) {
      if (!is_open(first)) continue;
      std::uint32_t last = first + 1;
      while (last < out.job.last && last - first < most && is_open(last)) ++last;
      return {first, last};
    }
  return {};
}

void Balancer::assign(WorkerId worker, const ColumnJob& job, Effects& effects) {
  ++jobs_;
  second_runs_ += holders()[job.first] > 0;
  assigned_.push_back({worker, job});
  effects.outbox.push_back({ToBalancer{}, worker, JobAssignment{job, false}});
  effects.events.push_back(JobAssigned{worker, job.first, job.last});
}

}  // namespace lichthof
