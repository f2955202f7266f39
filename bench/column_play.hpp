/// The balancer of the second pass in virtual time: as many workers as one likes, on columns whose cost is known.
#pragma once

#include <vector>

#include "core/tracing/balancer.hpp"

namespace lichthof::bench {

struct Play {
  double speed_up = 0;    ///< sum of all columns over the time of the last result (1)
  double idle_share = 0;  ///< of all workers' time, messages included (1)
  std::uint32_t jobs = 0;
};

/// @param column_s   what each column costs (s)
/// @param message_s  a job takes this much more for its two messages (s)
Play played(const std::vector<double>& column_s, std::uint32_t workers, Scheduling scheduling, double message_s);

}  // namespace lichthof::bench
