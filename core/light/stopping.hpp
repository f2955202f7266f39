/// When the first pass stops, where nobody says it.
#pragma once

#include "core/light/solution.hpp"

namespace lichthof {

/// True when every corner lies in front of every lit plane: then no surface hides anything from another. Scenes of more than 64
/// planes count as if it was not so. @cost  planes × corners at most; a furnished room ends at the first piece of furniture
bool nothing_is_hidden(const Scene& scene, const Mesh& mesh);

/// The share of the largest initial unshot power at which shooting ends: 2e-3 by rays, since that is judged by where it arrives
/// (docs/decisions/0049); for the method `hemicube` the paper's 5e-4 (§5), as its item buffers err more. Where nothing is hidden,
/// factors are exact and shots need no rays: what is left is all the error there is, and 1e-5 costs less than twice the time.
double default_eps(const Scene& scene, const Mesh& mesh, TransferMethod method);

}  // namespace lichthof
