/// Packets of 16 shadow rays as the first pass makes them: from clusters of receivers towards groups that shoot.
#pragma once

#include <vector>

#include "bench/bench_case.hpp"
#include "core/light/raycast.hpp"
#include "core/light/receiver_tree.hpp"

namespace lichthof::bench {

/// The receivers and rays of a scene in one cell, as CellLight holds them.
struct PacketScene {
  explicit PacketScene(const BenchCase& scene);

  Vec3 origin;  ///< world point of the local zero (m)
  RayScene rays;
  ReceiverTree tree;
};

/// Packets with all 16 lanes in use: lane i runs from receiver i to a random point of the group, both ends lifted.
/// Runs of packets share their group and come in the order of the receivers, as those of a shot do.
/// @returns `count` packets, or fewer where hardly any cluster sees a group
/// @param seed  of the choice
std::vector<Segments16> packets_of(const BenchCase& scene, const PacketScene& packets, std::size_t count,
                                   std::uint64_t seed);

}  // namespace lichthof::bench
