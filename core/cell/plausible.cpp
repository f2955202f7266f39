#include "core/cell/plausible.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

namespace {

constexpr std::size_t max_patches = 16;   // the mesher makes at most 4; room for other meshers
constexpr std::size_t max_corners = 16;   // of one polygon: the kernels take 20, and cutting elements adds 4
constexpr double frame_tolerance = 1e-4;

bool finite(const Vec2& v) { return std::isfinite(v.x) && std::isfinite(v.y); }

bool finite(const Rgbf& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

bool plausible_polygon(const std::vector<Vec2>& corners) {
  return corners.size() >= 3 && corners.size() <= max_corners &&
         std::all_of(corners.begin(), corners.end(), [](const Vec2& c) { return finite(c); });
}

bool plausible_patch(const ShotPatch& patch) {
  const std::size_t places = std::size_t{patch.columns} * patch.rows;
  return places >= 1 && places <= 16 && patch.delta.size() == places && patch.area.size() == places &&
         patch.openness.size() == places &&
         plausible_polygon(patch.corners) && finite(patch.lo) && finite(patch.hi) && finite(patch.reflected) &&
         finite(patch.emitted) &&
         std::all_of(patch.delta.begin(), patch.delta.end(), [](const Rgbf& d) { return finite(d); }) &&
         std::all_of(patch.area.begin(), patch.area.end(), [](float a) { return std::isfinite(a) && a >= 0; }) &&
         std::all_of(patch.openness.begin(), patch.openness.end(), [](float o) { return o >= 0 && o <= 1; });
}

bool plausible_plane(const Plane& plane) {
  if (!all_finite(plane.origin) || !all_finite(plane.u) || !all_finite(plane.v) || !all_finite(plane.normal))
    return false;
  const auto near = [](double value, double wanted) { return std::abs(value - wanted) <= frame_tolerance; };
  return near(glm::dot(plane.u, plane.u), 1) && near(glm::dot(plane.v, plane.v), 1) &&
         near(glm::dot(plane.u, plane.v), 0) && near(glm::dot(glm::cross(plane.u, plane.v), plane.normal), 1);
}

}  // namespace

bool plausible_power(double power_w) { return std::isfinite(power_w) && power_w >= 0; }

bool plausible(const Shot& shot, const CellGrid& grid) {
  if (shot.id.cell.value >= grid.cell_count() || !all_finite(shot.centre) || !plausible_plane(shot.plane)) return false;
  if (!(std::isfinite(shot.radius) && shot.radius > 0 && std::isfinite(shot.area) && shot.area > 0)) return false;
  if (shot.patches.empty() || shot.patches.size() > max_patches || !plausible_polygon(shot.corners)) return false;
  const Vec3 extent = grid.bounds().size();
  const double margin = 1e-3 * std::max({extent.x, extent.y, extent.z});
  return grid.box(shot.id.cell).contains(shot.centre, margin) &&
         std::all_of(shot.patches.begin(), shot.patches.end(), plausible_patch);
}

bool same_shot(const Shot& a, const Shot& b) {
  return a.id == b.id && a.version == b.version && a.centre == b.centre && a.plane.normal == b.plane.normal &&
         a.area == b.area && a.patches.size() == b.patches.size();
}

}  // namespace lichthof
