#include "core/light/cell_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace lichthof {

bool concerns(const Box& bounds, const Box& cell, double rim) {
  for (int axis = 0; axis < 3; ++axis)
    if (bounds.hi[axis] < cell.lo[axis] - rim || bounds.lo[axis] > cell.hi[axis] + rim) return false;
  return true;
}

namespace {

/// The largest share of a side that a wall may leave free and still count as closed.
constexpr double tightness = 1e-6;

Box bounds_of(const Surface& surface) {
  Box box;
  for (const Vec3& corner : surface.corners) box.include(corner);
  return box;
}

/// Area of what of the surface lies within the side's outline (m²).
double area_within(const Polygon& corners, const Box& side_box, int side) {
  Polygon part = corners;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == side / 2) continue;
    Vec3 direction{0.0};
    direction[axis] = 1;
    part = clipped(part, direction, side_box.lo[axis], 0.0);
    if (!part.empty()) part = clipped(part, -direction, -side_box.hi[axis], 0.0);
    if (part.empty()) return 0;
  }
  return 0.5 * glm::length(newell_vector(part));
}

/// Marks the walls that close a side. Pieces of a plane that face the same way do not overlap, so their areas tell.
void find_closed_walls(std::span<CoveringSurface> surfaces, const Box& side_box, int side, double rim) {
  const int axis = side / 2;
  const double at = side % 2 == 0 ? side_box.lo[axis] : side_box.hi[axis];
  const Vec3 size = side_box.size();
  const double side_area = size[(axis + 1) % 3] * size[(axis + 2) % 3], slack = 1e-6 * std::sqrt(side_area);
  struct Piece {
    bool faces_up;
    double height, area;
    CoveringSurface* surface;
  };
  std::vector<Piece> pieces;
  for (CoveringSurface& surface : surfaces) {
    const double height = surface.corners[0][axis];
    if (std::abs(surface.normal[axis]) < 1 - 1e-9 || std::abs(height - at) > rim) continue;
    const double area = area_within(Polygon(surface.corners.begin(), surface.corners.end()), side_box, side);
    if (area > 0) pieces.push_back({surface.normal[axis] > 0, height, area, &surface});
  }
  std::ranges::sort(pieces, {}, [](const Piece& piece) { return std::pair(piece.faces_up, piece.height); });
  for (std::size_t first = 0, end = 0; first < pieces.size(); first = end) {
    const auto is_same_plane = [&](const Piece& piece) {
      return piece.faces_up == pieces[first].faces_up && piece.height <= pieces[first].height + slack;
    };
    double area = 0;
    for (; end < pieces.size() && is_same_plane(pieces[end]); ++end) area += pieces[end].area;
    if (area < (1 - tightness) * side_area) continue;
    for (std::size_t k = first; k < end; ++k) pieces[k].surface->closes |= static_cast<std::uint8_t>(1u << side);
  }
}

}  // namespace

std::optional<std::vector<Surface>> surfaces_of(const Scene& scene, const Box& box, double rim) {
  const Box whole = bounds(scene);
  if (box.contains(whole.lo) && box.contains(whole.hi)) return std::nullopt;
  std::vector<Surface> own;
  for (const Surface& surface : scene.surfaces) {
    if (!concerns(bounds_of(surface), box, rim)) continue;
    own.push_back(surface);
    own.back().texcoords.clear();  // rays and bitmaps need none
  }
  return own;
}

std::vector<CoveringSurface> covering_surfaces(const Scene& scene, std::span<const Surface> surfaces, const Box& box,
                                               double rim) {
  std::vector<CoveringSurface> covering;
  for (const Surface& surface : surfaces)
    if (scene.material_of(surface).finish != Finish::glass)
      covering.push_back({surface.corners, surface.normal, bounds_of(surface)});
  const Box whole = bounds(scene);
  const Box side_box{glm::max(box.lo, whole.lo), glm::min(box.hi, whole.hi)};
  for (int side = 0; side < 6; ++side) find_closed_walls(covering, side_box, side, rim);
  return covering;
}

int side_towards(const Box& box, const Box& neighbour) {
  int side = 0;
  double widest =
      -std::numeric_limits<double>::infinity();  // the gap between two that touch is 0, and less on other axes
  for (int k = 0; k < 6; ++k) {
    const int axis = k / 2;
    const double gap = k % 2 == 0 ? box.lo[axis] - neighbour.hi[axis] : neighbour.lo[axis] - box.hi[axis];
    if (gap > widest) widest = gap, side = k;
  }
  return side;
}

}  // namespace lichthof
