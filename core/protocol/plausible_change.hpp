/// What a scene change must look like before it gets a number: once numbered it can not be taken back, every cell waits for
/// it. The controller asks here before it numbers, a cell before it applies.
#pragma once

#include <algorithm>

#include "core/protocol/messages.hpp"

namespace lichthof {

/// Finite values that a material can have: radiance ≥ 0, reflectance in [0, 1).
inline bool plausible(const GeometryChange& change) {
  const auto within = [](const Rgb& c, double limit) {
    return all_finite(c) && std::min({c.x, c.y, c.z}) >= 0 && max_channel(c) < limit;
  };
  if (const auto* emission = std::get_if<SetEmission>(&change.change)) return within(emission->radiance, 1e30);
  return within(std::get<SetReflectance>(change.change).reflectance, 1);
}

}  // namespace lichthof
