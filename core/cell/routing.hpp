/// Where a hemicube bitmap travels (§2, Fig. 1, 3, 4): visible zone, predecessors, successors.
///
/// Nothing is announced or stored: every cell works these out alike, from the grid and the copy of the shooting patch in
/// the message. With d = position(cell) - position(shooter's cell), a bitmap moves away from the shooter on every axis,
/// so whatever a predecessor projects is nearer than everything in the cell (Fig. 3), and a cell has at most one
/// predecessor per axis with d ≠ 0: two in 2-D, three in 3-D.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/light/cell_light.hpp"
#include "core/scene/partition.hpp"

namespace lichthof {

/// What routing needs to know of a shooter.
struct ShooterPose {
  CellId cell;
  Vec3 centre;  ///< inside the box of `cell`; within the mesher's tolerance of a side, exactly on it (m)
  Vec3 normal;  ///< unit; components that are only rounding are exactly 0
};

/// The pose as every cell sees it. Cleaning matters: a wall that lies on a cell boundary shoots along it, and rounding
/// alone must not drag the cells behind the wall into the zone.
/// @pre the shot is plausible (core/cell/plausible) for this grid
ShooterPose pose_of(const CellGrid& grid, const Shot& shot);

/// A few cells, in the order x, y, z, minus before plus; never on the heap.
class CellList {
 public:
  void push_back(CellId cell) { cells_[size_++] = cell; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const CellId* begin() const { return cells_.data(); }
  const CellId* end() const { return cells_.data() + size_; }
  CellId operator[](std::size_t i) const { return cells_[i]; }
  bool contains(CellId cell) const;

 private:
  std::array<CellId, 6> cells_{};
  std::size_t size_ = 0;
};

/// True when the cell's box reaches in front of the shooter's plane (Fig. 1); always for the shooter's own cell.
/// Each cell of the zone but the shooter's own has a predecessor in the zone, in floating point too: per axis the
/// distances n·(x - centre) are monotone along the way, and only boxes with a positive sum are in.
bool in_visible_zone(const CellGrid& grid, const ShooterPose& shooter, CellId cell);

/// All cells of the zone, ascending. @cost O(cells)
std::vector<CellId> visible_zone(const CellGrid& grid, const ShooterPose& shooter);

/// The cells whose bitmaps a cell waits for: one step nearer on every axis that differs, zone cells only. Empty for the
/// shooter's own cell, and for cells outside the zone.
CellList predecessors(const CellGrid& grid, const ShooterPose& shooter, CellId cell);

/// The cells a bitmap is sent on to: one step away from the shooter (d ≥ 0: plus, d ≤ 0: minus), zone cells only.
CellList successors(const CellGrid& grid, const ShooterPose& shooter, CellId cell);

/// Box around all zone cells that a bitmap can reach when it enters `cell`: the cell itself and everything behind it.
/// @cost O(cells along the axes)
Box reach(const CellGrid& grid, const ShooterPose& shooter, CellId cell);

/// Box around all cells still to come after `cell`: the reach of its successors. @pre it has successors
Box beyond(const CellGrid& grid, const ShooterPose& shooter, CellId cell);

}  // namespace lichthof
