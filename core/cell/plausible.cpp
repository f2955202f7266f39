#include "core/cell/plausible.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

namespace {

constexpr std::size_t max_patches = 64;  // of a group, see core/scene/mesh
constexpr std::size_t max_corners = 16;  // of one polygon: the kernels take 20, and cutting elements adds 4
constexpr double frame_tolerance = 1e-4;

// W/m²; twice over it is still far from the end of single precision, and no lamp comes near (io reads radiances to 1e12).
constexpr float largest_radiosity = 1e30f;

bool finite(const Vec2& v) { return std::isfinite(v.x) && std::isfinite(v.y); }

bool bounded(const Rgbf& c) {
  return std::abs(c.x) <= largest_radiosity && std::abs(c.y) <= largest_radiosity && std::abs(c.z) <= largest_radiosity;
}

bool plausible_polygon(const std::vector<Vec2>& corners) {
  return corners.size() >= 3 && corners.size() <= max_corners &&
         std::all_of(corners.begin(), corners.end(), [](const Vec2& c) { return finite(c); });
}

/// @returns what can't be, or nullptr
const char* fault_of(const ShotPatch& patch) {
  if (patch.branch >= 16) return "a place in its group that does not exist";
  const std::size_t places = std::size_t{patch.columns} * patch.rows;
  if (places < 1 || places > 16 || patch.delta.size() != places || patch.area.size() != places ||
      patch.openness.size() != places)
    return "arrays that do not fit its grid";
  if (!plausible_polygon(patch.corners) || !finite(patch.lo) || !finite(patch.hi)) return "an impossible outline";
  if (!bounded(patch.reflected) || !bounded(patch.emitted) ||
      !std::all_of(patch.delta.begin(), patch.delta.end(), bounded))
    return "an impossible radiosity";
  if (!std::all_of(patch.area.begin(), patch.area.end(), [](float a) { return std::isfinite(a) && a >= 0; }))
    return "an impossible area";
  if (!std::all_of(patch.openness.begin(), patch.openness.end(), [](float o) { return o >= 0 && o <= 1; }))
    return "an impossible openness";
  return nullptr;
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

ShotFault fault_of(const Shot& shot, const CellGrid& grid) {
  const auto fault = [&shot](const char* what, std::uint32_t patch = ShotFault::whole) {
    return ShotFault{what, shot.id, shot.group, patch};
  };
  if (shot.id.cell.value >= grid.cell_count()) return fault("a cell that does not exist");
  if (!plausible_plane(shot.plane)) return fault("an impossible plane");
  if (!all_finite(shot.centre)) return fault("an impossible centre");
  if (!(std::isfinite(shot.radius) && shot.radius > 0)) return fault("an impossible radius");
  if (!(std::isfinite(shot.area) && shot.area > 0)) return fault("an impossible area");
  if (shot.patches.empty() || shot.patches.size() > max_patches) return fault("too few or too many patches");
  if (!plausible_polygon(shot.corners)) return fault("an impossible outline");
  const Vec3 extent = grid.bounds().size();
  const double margin = 1e-3 * std::max({extent.x, extent.y, extent.z});
  if (!grid.box(shot.id.cell).contains(shot.centre, margin)) return fault("its centre outside of its cell");
  for (std::uint32_t p = 0; p < shot.patches.size(); ++p)
    if (const char* what = fault_of(shot.patches[p])) return fault(what, p);
  return {};
}

bool same_shot(const Shot& a, const Shot& b) {
  return a.id == b.id && a.version == b.version && a.centre == b.centre && a.plane.normal == b.plane.normal &&
         a.area == b.area && a.patches.size() == b.patches.size();
}

}  // namespace lichthof
