#include "core/tracing/worker.hpp"

#include <algorithm>

#include "core/base/check.hpp"

namespace lichthof {

Worker::Worker(WorkerId id, std::shared_ptr<const ColumnSource> source, std::uint32_t columns_per_step)
    : id_(id), source_(std::move(source)), columns_per_step_(columns_per_step) {
  MUST(columns_per_step >= 1);
}

void Worker::accept(const Envelope& envelope, Instant) {
  const auto* assignment = std::get_if<JobAssignment>(&envelope.message);
  if (!assignment || traced_ < job_.last) return;  // one job at a time: only what was asked for is taken
  if (assignment->no_more) {
    resting_ = true;
    return;
  }
  if (assignment->job.first >= assignment->job.last || assignment->job.last > source_->width()) return;
  job_ = assignment->job;
  traced_ = job_.first;
  pixels_.clear();
  rays_.clear();
}

Effects Worker::step(Instant) {
  MUST(has_work());
  Effects effects;
  if (!asked_) {
    asked_ = true;
    effects.outbox.push_back({id_, ToBalancer{}, JobRequest{id_}});
    return effects;
  }
  const std::uint32_t last = std::min(traced_ + columns_per_step_, job_.last);
  for (; traced_ < last; ++traced_) {
    std::uint64_t rays = 0;
    const std::vector<Rgbf> column = source_->columns({traced_, traced_ + 1}, rays);
    MUST(column.size() == source_->height());
    pixels_.insert(pixels_.end(), column.begin(), column.end());
    rays_.push_back(rays);
    effects.work.rays += rays;
    effects.work.pixels_traced += column.size();
  }
  if (traced_ == job_.last) {
    effects.outbox.push_back({id_, ToBalancer{}, ColumnResult{id_, job_, std::move(pixels_), std::move(rays_), 0}});
    effects.outbox.push_back({id_, ToBalancer{}, JobRequest{id_}});
    pixels_.clear();
    rays_.clear();
  }
  return effects;
}

}  // namespace lichthof
