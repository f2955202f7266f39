/// A shot as a cell sees it: in its local frame, at all levels of detail, with the points that its shadow rays aim at.
#pragma once

#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/occluders.hpp"

namespace lichthof {

/// 16 places of a source that shadow rays aim at, and what leaves them. Written twice, as the places are.
struct Aims {
  Aim16 place;
  float weight[32];        ///< of a place in means over all of the source: the rarer its like are aimed at, the more
  float reflected[3][32];  ///< as FlatSource::reflected
};

/// A polygon that shoots one value, in the cell's local frame.
struct FlatSource {
  FlatShooter flat;
  std::uint32_t first_aims = 0, aims_count = 0;  ///< LocalShot::aims; a power of two
  float reflected[3] = {};                       ///< unshot radiosity without emission (W/m²), signed
  float emitted[3] = {};                         ///< own emission (W/m²): arrives as direct light
  float radius = 0;                              ///< m
  FlatBox box;                                   ///< around the polygon
};

/// One level of detail of a piece of the shooter.
struct ShotPart {
  /// A branch is the group, a quarter of it, or a quarter of that.
  enum class Level : std::uint8_t { branch, patch, element };
  Level level = Level::branch;
  std::uint32_t end = 0;  ///< one past the last part that this one consists of; those follow it
  /// Some of it is veiled (core/light/openness), and some is not: no ray to one of these tells of the other.
  bool is_mixed = false;
  FlatSource source;
};

/// A shot brought into a cell's local frame.
struct LocalShot {
  std::vector<ShotPart> parts;           ///< the whole group first, each part before those it consists of
  std::vector<Aims> aims;                ///< of all parts
  bool reflects = false, emits = false;  ///< any of it is not zero
  const FlatSource& group() const { return parts.front().source; }
  /// Clusters aim at different places, so that together they see all of a source.
  const Aims& aims_of(const FlatSource& source, std::uint32_t cluster) const {
    return aims[source.first_aims + (cluster & (source.aims_count - 1))];
  }
};

LocalShot local_shot(const Shot& shot, const Vec3& origin);

}  // namespace lichthof
