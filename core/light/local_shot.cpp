#include "core/light/local_shot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lichthof {

namespace {

std::vector<Vec3> world_corners(const Plane& plane, std::span<const Vec2> corners) {
  std::vector<Vec3> world;
  world.reserve(corners.size());
  for (const Vec2& c : corners) world.push_back(plane.point(c));
  return world;
}

template <class PointOfLane>
void set_aims(Aim16& aim, PointOfLane&& point_of_lane) {
  for (int lane = 0; lane < 16; ++lane) {
    const Vec3 point = point_of_lane(lane);
    aim.x[lane] = aim.x[lane + 16] = static_cast<float>(point.x);
    aim.y[lane] = aim.y[lane + 16] = static_cast<float>(point.y);
    aim.z[lane] = aim.z[lane + 16] = static_cast<float>(point.z);
  }
}

/// Aims at elements in proportion to what is open of them. Aiming blindly multiplies the mean radiosity by the mean visibility,
/// but what is hidden under furniture is dark as well: the product of means loses several percent.
/// @param open_area  of each element (m²)
void aim_where_it_is_open(FlatSource& source, std::span<const FlatSource> elements, std::span<const float> open_area) {
  std::array<float, 64> up_to;
  float total = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) up_to[e] = total += open_area[e];
  if (!(total > 0)) return;
  set_aims(source.aim, [&](int lane) {
    // Strata of equal area; neighbouring lanes take strata far apart.
    const float wanted = (static_cast<float>(lane * 5 & 15) + 0.5f) / 16.f * total;
    const auto found = std::lower_bound(up_to.begin(), up_to.begin() + static_cast<std::ptrdiff_t>(elements.size()) - 1, wanted);
    const FlatShooter& f = elements[static_cast<std::size_t>(found - up_to.begin())].flat;
    return Vec3{f.cx, f.cy, f.cz};
  });
}

FlatSource source_of(const Plane& plane, std::span<const Vec2> corners, const Vec3& origin, const Rgbf& reflected,
                     const Rgbf& emitted) {
  FlatSource source;
  source.flat = flat_shooter(world_corners(plane, corners), plane.normal, origin);
  source.box = box_of(source.flat);
  set_aims(source.aim, [&](int) { return Vec3{source.flat.cx, source.flat.cy, source.flat.cz}; });
  for (int c = 0; c < 3; ++c) source.reflected[c] = reflected[c], source.emitted[c] = emitted[c];
  const FlatShooter& f = source.flat;
  for (int k = 0; k < f.count; ++k) {
    const float x = f.x[k] - f.cx, y = f.y[k] - f.cy, z = f.z[k] - f.cz;
    source.radius = std::max(source.radius, std::sqrt(x * x + y * y + z * z));
  }
  return source;
}

/// Polygon of one grid place of a shooting patch; a rectangle where the patch is one.
void element_corners(const ShotPatch& patch, int column, int row, bool rectangular, Polygon2& corners) {
  const Vec2 step = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
  const Vec2 lo = patch.lo + step * Vec2{column, row}, hi = lo + step;
  corners = {lo, {hi.x, lo.y}, hi, {lo.x, hi.y}};
  if (rectangular) return;
  const double slack = 1e-9 * (step.x + step.y);
  Polygon2 piece = patch.corners;
  piece = clipped(piece, Vec2{1, 0}, lo.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{-1, 0}, -hi.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, 1}, lo.y, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, -1}, -hi.y, slack);
  corners = std::move(piece);
}

}  // namespace

LocalShot local_shot(const Shot& shot, const Vec3& origin) {
  LocalShot local;
  Rgbf group_reflected{0.f}, group_emitted{0.f};
  float group_area = 0;
  local.first_element.push_back(0);
  std::vector<float> open_areas;
  Polygon2 corners;
  for (const ShotPatch& patch : shot.patches) {
    float area = 0;
    for (const float a : patch.area) area += a;
    group_reflected += area * patch.reflected;
    group_emitted += area * patch.emitted;
    group_area += area;
    local.emits |= patch.emitted != Rgbf{0.f};
    local.patches.push_back(source_of(shot.plane, patch.corners, origin, patch.reflected, patch.emitted));
    const Vec2 size = patch.hi - patch.lo;
    const bool rectangular =
        patch.corners.size() == 4 && std::abs(signed_area(patch.corners) - size.x * size.y) <= 1e-9 * size.x * size.y;
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) {
        const std::size_t place = static_cast<std::size_t>(row) * patch.columns + static_cast<std::size_t>(column);
        if (patch.area[place] <= 0) continue;
        element_corners(patch, column, row, rectangular, corners);
        if (corners.size() < 3) continue;
        local.reflects |= patch.delta[place] != patch.emitted;
        local.elements.push_back(source_of(shot.plane, corners, origin, patch.delta[place] - patch.emitted, patch.emitted));
        open_areas.push_back(patch.openness[place] * patch.area[place]);
      }
    const std::size_t first = local.first_element.back();
    aim_where_it_is_open(local.patches.back(), std::span(local.elements).subspan(first), std::span(open_areas).subspan(first));
    local.first_element.push_back(static_cast<std::uint32_t>(local.elements.size()));
  }
  local.group = source_of(shot.plane, shot.corners, origin, group_reflected / group_area, group_emitted / group_area);
  aim_where_it_is_open(local.group, local.elements, open_areas);
  return local;
}

}  // namespace lichthof
