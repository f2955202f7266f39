/// How long a step takes on a node: work done times coefficients. The defaults are those of the reference machine
/// (numerics, section 7); bench/ measures others.
#pragma once

#include "core/protocol/effects.hpp"

namespace lichthof::sim {

struct CostModel {
  double ray_ns = 40;         ///< shadow ray in a packet of 16
  double cluster_ns = 61;     ///< tests, form factors and accumulation of 16 receivers
  double bitmap_ns = 50'000;  ///< filling one cell's surfaces into a bitmap, R = 128
  double pixel_ns = 20'000;   ///< second pass, one pixel
  double byte_ns = 2;         ///< packing and sending
  double step_ns = 3'000;     ///< any step at all: mailbox, selection of the shooter

  /// @param speed  of the node relative to the reference machine, all its cores together (1)
  Duration duration(const WorkDone& work, double speed) const;
};

}  // namespace lichthof::sim
