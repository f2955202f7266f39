#include "core/cell/routing.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

/// The mesher's planes agree within 4e-6 of the scene's size: a centre this close to a side lies on it.
constexpr double side_tolerance = 1e-5;
/// Below this a component of a unit normal is rounding.
constexpr double normal_tolerance = 1e-5;

/// How far the box reaches in front of the shooter's plane (m, at most): the sum over the axes of the better end.
double front_distance(const Box& box, const ShooterPose& shooter) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double n = shooter.normal[axis];
    sum += n * ((n > 0 ? box.hi[axis] : box.lo[axis]) - shooter.centre[axis]);
  }
  return sum;
}

int step_of(std::uint32_t from, std::uint32_t to) { return to > from ? 1 : to < from ? -1 : 0; }

CellPosition moved(CellPosition position, int axis, int step) {
  position[axis] = static_cast<std::uint32_t>(static_cast<std::int64_t>(position[axis]) + step);
  return position;
}

/// Positions that a bitmap entering `cell` can still reach, zone or not.
void fan(const CellGrid& grid, const CellPosition& shooter, const CellPosition& cell, CellPosition& lo,
         CellPosition& hi) {
  for (int axis = 0; axis < 3; ++axis) {
    const int step = step_of(shooter[axis], cell[axis]);
    lo[axis] = step > 0 ? cell[axis] : 0;
    hi[axis] = step < 0 ? cell[axis] : grid.size()[axis] - 1;
  }
}

void include(Box& box, const Box& other) {
  box.include(other.lo);
  box.include(other.hi);
}

}  // namespace

bool CellList::contains(CellId cell) const { return std::find(begin(), end(), cell) != end(); }

ShooterPose pose_of(const CellGrid& grid, const Shot& shot) {
  ShooterPose pose{shot.id.cell, shot.centre, shot.plane.normal};
  const Box box = grid.box(pose.cell);
  const Vec3 extent = grid.bounds().size();
  const double tolerance = side_tolerance * std::max({extent.x, extent.y, extent.z});
  for (int axis = 0; axis < 3; ++axis) {
    double& c = pose.centre[axis];
    if (c < box.lo[axis] + tolerance) c = box.lo[axis];
    if (c > box.hi[axis] - tolerance) c = box.hi[axis];
    if (std::abs(pose.normal[axis]) < normal_tolerance) pose.normal[axis] = 0;
  }
  return pose;
}

bool in_visible_zone(const CellGrid& grid, const ShooterPose& shooter, CellId cell) {
  return cell == shooter.cell || front_distance(grid.box(cell), shooter) > 0;
}

std::vector<CellId> visible_zone(const CellGrid& grid, const ShooterPose& shooter) {
  std::vector<CellId> zone;
  for (CellId cell{0}; cell.value < grid.cell_count(); ++cell.value)
    if (in_visible_zone(grid, shooter, cell)) zone.push_back(cell);
  return zone;
}

CellList predecessors(const CellGrid& grid, const ShooterPose& shooter, CellId cell) {
  CellList list;
  if (!in_visible_zone(grid, shooter, cell)) return list;
  const CellPosition from = grid.position(shooter.cell), to = grid.position(cell);
  for (int axis = 0; axis < 3; ++axis) {
    const int step = step_of(from[axis], to[axis]);
    if (step == 0) continue;
    const CellId nearer = grid.at(moved(to, axis, -step));
    if (in_visible_zone(grid, shooter, nearer)) list.push_back(nearer);
  }
  return list;
}

CellList successors(const CellGrid& grid, const ShooterPose& shooter, CellId cell) {
  CellList list;
  if (!in_visible_zone(grid, shooter, cell)) return list;
  const CellPosition from = grid.position(shooter.cell), at = grid.position(cell);
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1}) {
      if (step == -step_of(from[axis], at[axis])) continue;  // that way lies the shooter
      if (step < 0 ? at[axis] == 0 : at[axis] + 1 == grid.size()[axis]) continue;
      const CellId farther = grid.at(moved(at, axis, step));
      if (in_visible_zone(grid, shooter, farther)) list.push_back(farther);
    }
  return list;
}

Box reach(const CellGrid& grid, const ShooterPose& shooter, CellId cell) {
  CellPosition lo, hi;
  fan(grid, grid.position(shooter.cell), grid.position(cell), lo, hi);
  // Trim the slabs that lie wholly behind the shooter's plane; the plane can only cut them off at the ends of the fan.
  const auto behind = [&](int axis, std::uint32_t slab) {
    CellPosition slab_lo = lo, slab_hi = hi;
    slab_lo[axis] = slab_hi[axis] = slab;
    return front_distance(grid.box(slab_lo, slab_hi), shooter) <= 0;
  };
  for (int axis = 0; axis < 3; ++axis) {
    while (lo[axis] < hi[axis] && behind(axis, lo[axis])) ++lo[axis];
    while (lo[axis] < hi[axis] && behind(axis, hi[axis])) --hi[axis];
  }
  return grid.box(lo, hi);
}

Box beyond(const CellGrid& grid, const ShooterPose& shooter, CellId cell) {
  const CellList next = successors(grid, shooter, cell);
  MUST(!next.empty());
  Box box;
  for (const CellId successor : next) include(box, reach(grid, shooter, successor));
  return box;
}

}  // namespace lichthof
