/// The light that leaves the scene: the one entry of the energy ledger that no receiver can report.
#pragma once

#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

/// Power that left the scene with the shots of the first pass, summed over the channels (W):
///
///     Σ_groups Σ_channels S A · (share of the group's rays that meet nothing)
///
/// Each lit group that has shot sends 64 rays from points spread over its area, their directions in 8 x 8 strata of the
/// cosine-weighted hemisphere. The rays meet the scene's own surfaces, without those of glass. So this is a measurement of
/// its own, not the rest that would make the ledger balance.
/// @cost  64 rays per group, 16 at a time; the answer does not depend on the number of threads
double escaped_power(const Solution& solution, const Parallel& parallel);

}  // namespace lichthof
