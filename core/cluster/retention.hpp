/// Which of the jobs that have ended a lab forgets, so that what it remembers and what lies on its disk stay bounded. It alone
/// weighs age, number and size against what somebody may still want to fetch.
///
/// - A job older than `most_days` goes.
/// - While there are more than `most_jobs`, or more bytes than `most_bytes`: those go that nobody will miss, the oldest first.
///   That is who was fetched, or cancelled, or ended longer than `unfetched_days` ago.
/// - A job that nobody has fetched stays that long, whatever the other bounds say. When such jobs alone fill them, no new job is
///   taken.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/ids.hpp"

namespace lichthof {

struct RetentionOptions {
  std::uint32_t most_jobs = 2000;
  std::uint64_t most_bytes = 64ull << 30;  ///< of results and light
  double most_days = 30;                   ///< since the end; not below unfetched_days
  double unfetched_days = 7;
};

/// A job that has ended.
struct EndedJob {
  JobId job;
  double ended_s = 0;       ///< any clock that goes on while the controller does not
  bool is_wanted = false;   ///< somebody may still come for it: neither fetched nor cancelled
  std::uint64_t bytes = 0;  ///< on disk, for it alone
};

struct Retention {
  std::vector<JobId> forgotten;  ///< to be forgotten now, in this order
  bool is_full = false;          ///< without them the bounds are still reached: no new job
};

/// @cost O(n log n)
Retention retention(std::vector<EndedJob> ended, const RetentionOptions& options, double now_s);

}  // namespace lichthof
