/// The surfaces of a cell as what may stand in the way: which of them can block anything between a shooter and some
/// receivers, and which lanes of a packet they block. Where few are left, or none, no ray needs to be traced.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "core/light/kernels/kernels.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// An axis-aligned box in a cell's local frame (m).
struct FlatBox {
  float lo[3], hi[3];
};

FlatBox box_of(const FlatPolygon& polygon);
/// Of what has bounds: nodes and clusters of the receiver tree.
template <class Bounded>
requires requires(const Bounded& b) { b.lo[2] < b.hi[2]; }
FlatBox box_of(const Bounded& bounded) {
  FlatBox box;
  std::copy_n(bounded.lo, 3, box.lo), std::copy_n(bounded.hi, 3, box.hi);
  return box;
}

/// The hull of two boxes with all segments between them, whose ends are lifted off their surfaces by `offset` (m).
Shaft shaft_between(const FlatBox& shooter, const FlatBox& receivers, float offset);

/// Some occluders, packed anew into as few blocks as they need.
struct OccluderSelection {
  std::vector<Occluders16> blocks;
  std::vector<ShooterSides> sides;
  std::vector<Candidates> candidates;  ///< all of them
  bool complete = true;                ///< false: there are more than asked for, and none is here
};

class Occluders {
 public:
  /// @param surfaces  of the cell; numbers of occluders are indices into it. Surfaces of glass stand in nobody's way
  /// @param offset    m; RayScene::offset
  Occluders(const Scene& scene, std::span<const Surface> surfaces, const Vec3& origin, double offset);

  FlatOccluder operator[](std::uint32_t surface) const {
    const Facing& f = facing_[surface];
    return {
        {edges_.data() + first_edge_[surface], edges_.data() + first_edge_[surface + 1]}, f.nx, f.ny, f.nz, f.plane};
  }
  /// On which side of each plane the whole polygon lies, for in_shaft(). @cost about 0.1 µs per 16 occluders
  std::vector<ShooterSides> sides_of(const FlatPolygon& shooter) const;
  /// Those that may block a segment in the shaft. @param sides  of the shooter
  OccluderSelection in_shaft(const Shaft& shaft, std::span<const ShooterSides> sides, std::size_t most) const;
  std::size_t memory_bytes() const;

 private:
  void add_blocks(std::span<std::uint32_t> surfaces, const std::vector<FlatBox>& boxes);
  void add_levels();
  struct Search;
  void search(Search& found, std::size_t level, std::size_t node) const;
  bool lie_in_plane_of_first(std::span<const Occluders16> blocks) const;
  std::uint32_t lanes_of(std::size_t level, std::size_t node) const;

  struct Facing {
    float nx, ny, nz, plane;  ///< as in FlatOccluder
  };

  float slack_;
  std::vector<Facing> facing_;             ///< by surface
  std::vector<OccluderEdge> edges_;        ///< of one surface after the other
  std::vector<std::uint32_t> first_edge_;  ///< by surface, and one more
  std::vector<Occluders16> blocks_;        ///< neighbours in space share one; what is as large as a room comes first
  std::vector<std::uint32_t> lanes_;       ///< per block, those that hold an occluder
  /// Bounds of 16 blocks each, then of 16 of those each, and so on up to a single one. What lies in one plane has that, for it
  /// to be left out as a whole; others have none.
  std::vector<std::vector<Occluders16>> levels_;
  std::vector<std::size_t> first_side_;  ///< per level, in what sides_of() gives: all blocks come first
};

}  // namespace lichthof
