/// The sections of `lichthof bench`. Each measures what it compares in one run, so its ratios hold whatever the machine;
/// absolute figures are those of this machine. Times are CPU seconds unless a figure says wall clock.
///
/// @error of all: interrupted when the case was stopped; what its solve() says
#pragma once

#include "bench/bench_case.hpp"
#include "bench/section.hpp"

namespace lichthof::bench {

/// Form factors: every vector width against the scalar double one, on the same pairs of clusters and patches of the scene;
/// filling a bitmap (µs) and looking into one (ns per 16 directions).
Expected<Section> kernels_section(const BenchCase& scene);

/// Rays that the first pass gets answered per CPU second against what the ray tracer alone does on packets of its kind.
Expected<Section> radiosity_section(const BenchCase& scene);

/// One thread against two, wall clock, both passes; and whether the bits agree.
Expected<Section> threads_section(const BenchCase& scene);

/// Shadow rays against the item buffer on the hemicube, on one mesh: CPU time, and error against path tracing.
Expected<Section> methods_section(const BenchCase& scene);

/// The same scene in 1 to 8 cells: difference to one cell, messages, bitmaps.
Expected<Section> cells_section(const BenchCase& scene);

/// Idle time of two workers of the second pass, and the speed-up of 38 in virtual time on measured columns.
Expected<Section> balance_section(const BenchCase& scene);

}  // namespace lichthof::bench
