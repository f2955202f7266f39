/// Who shoots next: the external shooting patch buffer against the best local patch (§2: "at the beginning of each
/// iteration, it is tested if the maximum unshot radiosity of the received external shooting patch is larger than the
/// unshot radiosity of the locally selected shooting patch").
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <set>

#include "core/cell/bitmap_join.hpp"

namespace lichthof {

enum class NextShooter : std::uint8_t { none, local, external };

class ShooterQueue {
 public:
  /// @param waiting_limit  with so many external shots waiting, none of the own patches shoots until they are worked off:
  ///                       a bright cell would otherwise heap up the bitmaps of all others
  explicit ShooterQueue(std::size_t waiting_limit) : waiting_limit_(waiting_limit) {}

  void push(ExternalShot shot);

  /// The stronger of both by |power|; the external one when they are equal, because other cells wait behind it.
  /// @param local_w      power of the strongest local candidate (W)
  /// @param threshold_w  a local candidate shoots only above it (W); external shots are always finished
  /// @param version      scene version of this cell: shots of later versions wait until it is reached
  NextShooter next(double local_w, double threshold_w, SceneVersion version) const;

  /// The strongest external shot of a known version. @pre next() returned external for the same version
  ExternalShot pop_external(SceneVersion version);

  /// Power of the strongest external shot of a known version (W); 0 when there is none.
  double strongest_external(SceneVersion version) const;

  std::size_t size() const;
  /// Messages joined into the shots that wait here.
  std::uint64_t parts() const;
  std::size_t memory_bytes() const;

 private:
  struct Rank {
    double power_w;
    ShotId id;
    /// Strongest first; equal ones by id, so that every run takes the same.
    bool operator<(const Rank& other) const {
      return power_w != other.power_w ? power_w > other.power_w : id < other.id;
    }
  };
  using Ranked = std::map<Rank, ExternalShot>;
  const Ranked* best_of(SceneVersion version) const;

  std::size_t waiting_limit_;
  std::map<SceneVersion, Ranked> by_version_;  ///< no entry is empty; usually there is one
};

}  // namespace lichthof
