#include "core/tracing/balancer.hpp"

#include <algorithm>
#include <cmath>

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
      first_round_left_(options.workers),
      first_round_size_(adaptive_size(options.columns, options.workers, options.time_ratio)),
      is_finished_(options.columns, 0), image_(options.columns, options.height) {
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
                     result.pixels.size() == std::size_t{job.size()} * options_.height;
  if (!sound || refused_.contains(result.worker)) {
    // A worker that sends nonsense gets no more work; its columns go to others.
    effects.events.push_back(MessageRefused{});
    refused_.insert(result.worker);
    on(WorkerLost{result.worker}, effects);
    return;
  }
  std::erase_if(assigned_[result.worker],
                [&](const ColumnJob& own) { return own.first >= job.first && own.last <= job.last; });

  // Columns that came before are left as they are: a result is the same whoever computed it.
  bool news = false;
  for (std::uint32_t column = job.first; column < job.last; ++column) {
    if (is_finished_[column]) continue;
    is_finished_[column] = 1;
    ++finished_columns_;
    news = true;
    image_.set_columns(column,
                       {result.pixels.data() + std::size_t{column - job.first} * options_.height, options_.height});
  }
  if (!news) return;
  rays_ += result.rays;
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
  const auto found = assigned_.find(worker);
  if (found == assigned_.end()) return;
  for (const ColumnJob& job : found->second) return_to_pool(job);
  assigned_.erase(found);
}

void Balancer::return_to_pool(const ColumnJob& job) {
  for (std::uint32_t column = job.first; column < job.last; ++column) {
    if (is_finished_[column]) continue;
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

void Balancer::serve_waiting(Effects& effects) {
  while (!waiting_.empty() && (work_load_ > 0 || finished())) {
    const WorkerId worker = waiting_.front();
    waiting_.pop_front();
    if (work_load_ > 0)
      assign(worker, effects);
    else
      effects.outbox.push_back({ToBalancer{}, worker, JobAssignment{{}, true}});
  }
}

std::uint32_t Balancer::next_size() const {
  if (options_.scheduling == Scheduling::boxes) return (options_.columns + options_.boxes - 1) / options_.boxes;
  return first_round_left_ > 0 ? first_round_size_ : adaptive_size(work_load_, workers_, options_.time_ratio);
}

void Balancer::assign(WorkerId worker, Effects& effects) {
  ColumnJob& range = pool_.front();
  const std::uint32_t size = std::min(next_size(), range.size());
  const ColumnJob job{range.first, range.first + size};
  range.first += size;
  if (range.size() == 0) pool_.erase(pool_.begin());
  work_load_ -= size;
  if (first_round_left_ > 0) --first_round_left_;
  ++jobs_;
  assigned_[worker].push_back(job);
  effects.outbox.push_back({ToBalancer{}, worker, JobAssignment{job, false}});
  effects.events.push_back(JobAssigned{worker, job.first, job.last});
}

}  // namespace lichthof
