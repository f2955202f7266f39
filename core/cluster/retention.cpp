#include "core/cluster/retention.hpp"

#include <algorithm>

namespace lichthof {

Retention retention(std::vector<EndedJob> ended, const RetentionOptions& options, double now_s) {
  constexpr double day_s = 86400;
  std::sort(ended.begin(), ended.end(), [](const EndedJob& a, const EndedJob& b) {
    return a.ended_s != b.ended_s ? a.ended_s < b.ended_s : a.job < b.job;
  });
  std::size_t jobs = ended.size();
  std::uint64_t bytes = 0;
  for (const EndedJob& job : ended) bytes += job.bytes;
  Retention result;
  for (const EndedJob& job : ended) {
    const double age_s = now_s - job.ended_s;
    const bool is_missed = job.is_wanted && age_s < options.unfetched_days * day_s;
    const bool is_old = age_s >= options.most_days * day_s;
    const bool is_too_much = jobs > options.most_jobs || bytes > options.most_bytes;
    if (is_missed || !(is_old || is_too_much)) continue;
    result.forgotten.push_back(job.job);
    --jobs, bytes -= job.bytes;
  }
  result.is_full = jobs > options.most_jobs || bytes > options.most_bytes;
  return result;
}

}  // namespace lichthof
