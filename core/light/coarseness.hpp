/// How coarse elements may be on each side of a scene's surfaces: where what a side looks at is far away, its irradiance varies
/// slowly, and elements are large.
#pragma once

#include <vector>

#include "core/base/parallel.hpp"
#include "core/light/raycast.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// Each side's mean free path l is the geometric mean of how far cosine-distributed rays from it go (m); those that meet nothing go
/// as far as the scene is large. Elements of one size suffice up to a length c, beyond it they grow with l:
///
///     size = h 2^k,   k = ⌊log2(max(1, l / 2c))⌋,   c: the smallest ≥ l' with N c² ≥ r² Σ A min(1, c²/l²)
///
/// l' is a low quantile of l, by min(1, A/l²) of what is no lamp: rooms of any size weigh alike, and so does the ground they stand on.
/// But furniture close to the wall must not make that wall coarse: up to where N = 12 000 elements resolve c by r = 14 each way, they
/// may be even. So the elements of a room, or of a building of many, are even; the ground and the sky around have few, and no side
/// has less than 2 r in l.
///
/// @param lit  what light does not reach has no part in it; coarseness is filled in
/// @cost  16 rays for each side, 0.1 µs each; the answer does not depend on the number of threads, nor on the unit of length
void find_coarseness(const Scene& scene, const RayScene& rays, const Parallel& parallel, std::vector<LitSides>& lit);

}  // namespace lichthof
