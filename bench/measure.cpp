#include "bench/measure.hpp"

#include <algorithm>
#include <ctime>

namespace lichthof::bench {

namespace {

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

double cpu_s() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }
double wall_s() { return seconds_of(CLOCK_MONOTONIC); }

double cpu_s_per_call(const std::function<void()>& work, double least_s) {
  work();
  const double start = cpu_s();
  unsigned calls = 0;
  double elapsed = 0;
  do {
    work();
    ++calls;
    elapsed = cpu_s() - start;
  } while (elapsed < least_s);
  return elapsed / calls;
}

std::vector<double> cpu_s_per_call(const std::vector<std::function<void()>>& works, unsigned repeat) {
  std::vector<double> least(works.size(), 1e300);
  for (unsigned round = 0; round < repeat; ++round)
    for (std::size_t k = 0; k < works.size(); ++k) least[k] = std::min(least[k], cpu_s_per_call(works[k]));
  return least;
}

void keep(double value) { asm volatile("" : : "m"(value)); }

}  // namespace lichthof::bench
