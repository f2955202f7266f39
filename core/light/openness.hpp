/// How open it is around each element: where one hemicube stands for a whole shooter, it stands where light can leave it, and not
/// under its furniture; of a few rays most aim there (core/light/local_shot).
///
/// Openness follows from the geometry alone. So does, with it, which share of a shooter's light arrives where, whatever the order
/// and number of shots: runs that end differently do so by what they have not shot, not by where they happened to look.
#pragma once

#include <span>

#include "core/base/parallel.hpp"
#include "core/light/raycast.hpp"
#include "core/light/receiver_tree.hpp"

namespace lichthof {

/// Sets Cluster::openness: the square of the mean of min(1, free distance / 8 patches) over cosine-distributed rays.
/// 0 where it is *veiled*: a luminaire that faces it shines on it from so near that it hides it from nearly all else. What is seen of
/// the surfaces around tells nothing of such a spot, and no mean over both is seen from anywhere: it shoots for itself.
/// @param shining  by surface of `rays`, its normal if its front emits, or 0
/// @param patch_size  m
/// @cost  8 rays an element, about 1.5 µs
void find_openness(ReceiverTree& tree, const RayScene& rays, std::span<const Vec3> shining, double patch_size,
                   const Parallel& parallel);

}  // namespace lichthof
