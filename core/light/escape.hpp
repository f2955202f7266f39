/// The light that leaves the scene: the one entry of the energy ledger that no receiver can report.
#pragma once

#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

/// Of what leaves a group, the share that meets nothing; and the variance of this number, or more: strata make it smaller.
struct OpenShare {
  double share = 0, variance = 0;
};

/// Each lit group that has a weight sends 64 rays from points spread over its area, their directions in 8 x 8 strata of the
/// cosine-weighted hemisphere. If any meets nothing, more follow: of some 65 000 as large a part as its weight is of all weights.
/// The rays meet the scene's own surfaces, without those of glass. So this is a measurement of its own, not the rest that would
/// make the ledger balance.
/// @param weights  of the groups, ≥ 0: the power they send
/// @cost  64 rays per group and 65 000, 16 at a time; the answer does not depend on the number of threads
std::vector<OpenShare> open_shares(const Scene& scene, const Mesh& mesh, std::span<const double> weights,
                                   const Parallel& parallel);

}  // namespace lichthof
