/// Clocks for benchmarks, and how a figure is taken from them: the best of some rounds, because whatever else the machine
/// does can only add time.
#pragma once

#include <functional>
#include <vector>

namespace lichthof::bench {

/// CPU time of this process, all its threads together (s).
double cpu_s();
/// Wall clock since some instant (s).
double wall_s();

/// Calls `work` once unmeasured, then until `least_s` of CPU time are over. @returns CPU seconds per call
double cpu_s_per_call(const std::function<void()>& work, double least_s = 0.05);

/// The same for several works in turn, `repeat` rounds of them, so that what disturbs one disturbs all.
/// @returns for each the least CPU seconds per call
std::vector<double> cpu_s_per_call(const std::vector<std::function<void()>>& works, unsigned repeat);

/// Keeps a result, and with it the work that led there, from being optimised away.
void keep(double value);

}  // namespace lichthof::bench
