/// A shot as a cell sees it: in its local frame, at all levels of detail, with the points that its shadow rays aim at.
#pragma once

#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/occluders.hpp"

namespace lichthof {

/// A polygon that shoots one value, in the cell's local frame.
struct FlatSource {
  FlatShooter flat;
  Aim16 aim;
  float reflected[3] = {};  ///< unshot radiosity without emission (W/m²), signed
  float emitted[3] = {};    ///< own emission (W/m²): arrives as direct light
  float radius = 0;         ///< m
  FlatBox box;              ///< around the polygon
};

/// One level of detail of a piece of the shooter.
struct ShotPart {
  /// A branch is the group, a quarter of it, or a quarter of that.
  enum class Level : std::uint8_t { branch, patch, element };
  Level level = Level::branch;
  std::uint32_t end = 0;  ///< one past the last part that this one consists of; those follow it
  FlatSource source;
};

/// A shot brought into a cell's local frame.
struct LocalShot {
  std::vector<ShotPart> parts;           ///< the whole group first, each part before those it consists of
  bool reflects = false, emits = false;  ///< any of it is not zero
  const FlatSource& group() const { return parts.front().source; }
};

LocalShot local_shot(const Shot& shot, const Vec3& origin);

}  // namespace lichthof
