/// Which sides of the surfaces light can reach at all: the inside of a closed box never needs a patch.
#pragma once

#include <vector>

#include "core/base/parallel.hpp"
#include "core/light/raycast.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// 1. A side proves that it is lit: of random walks from it, one comes to a point that sees a luminaire. A side that none
///    of w walks proves has, with 95 % confidence, less than 3/w of its walks lit.
/// 2. So are sides that light meets on its way on from places that proved lit, from room to room: a walk from the last of many rooms
///    hardly comes to the lamp in the first. A back that proves nothing so is dark. (It sees lit surfaces all the same: a box without a
///    bottom sees the floor it stands on.) What it would send on is lost; its own light is not, since the second pass gathers where no
///    elements are.
/// 3. A front that light meets on its way from the luminaires, in 4096 walks, is lit: the ground that is the floor of a room, too, of which
///    hardly a walk from it comes to that room.
/// 4. A front that proves nothing sends rays; if they meet a lit side, or a front that is joined to one by such rays, it is
///    lit. So only what is walled in lies dormant.
///
/// @param block  m; the size of a block of the mesh
/// @cost  a ray each, about 0.2 µs; the answer does not depend on the number of threads
std::vector<LitSides> lit_sides(const Scene& scene, const RayScene& rays, double block, const Parallel& parallel);

}  // namespace lichthof
