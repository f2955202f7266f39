#include "core/light/coarseness.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"

namespace lichthof {

namespace {

/// A lit side as far as its elements' size goes.
struct Outlook {
  double area = 0;       ///< m²
  double free_path = 0;  ///< m
  double weight = 0;     ///< for what is typical
};

/// @param side  2s: front, 2s + 1: back of surface s
double free_path(const Scene& scene, const RayScene& rays, std::size_t side, double extent) {
  const Surface& surface = scene.surfaces[side / 2];
  const Vec3 normal = side % 2 ? -surface.normal : surface.normal;
  Vec3 tangent, bitangent;
  complete_frame(normal, tangent, bitangent);
  Segments16 segments;
  clear_segments(segments);
  Random random(side, 3);
  for (std::uint32_t lane = 0; lane < 16; ++lane) {
    const Vec3 from = point_of(surface, {random.unit(), random.unit()}) + rays.offset() * normal - rays.origin();
    const Vec3 local = cosine_direction(r2_point(lane, {0.5, 0.5}));
    const Vec3 direction = local.x * tangent + local.y * bitangent + local.z * normal;
    segments.ox[lane] = static_cast<float>(from.x), segments.dx[lane] = static_cast<float>(direction.x);
    segments.oy[lane] = static_cast<float>(from.y), segments.dy[lane] = static_cast<float>(direction.y);
    segments.oz[lane] = static_cast<float>(from.z), segments.dz[lane] = static_cast<float>(direction.z);
  }
  RayScene::Hits16 hits;
  rays.nearest16(segments, 0xffff, hits);
  double sum = 0;
  for (int lane = 0; lane < 16; ++lane) {
    const bool is_met = hits.surface[lane] != RayScene::no_surface;
    sum += std::log(is_met ? std::clamp(static_cast<double>(hits.distance[lane]), rays.offset(), extent) : extent);
  }
  return std::exp(sum / 16);
}

/// The length c of the header's formula (m).
double even_length(std::vector<Outlook> outlooks) {
  constexpr double elements = 12000, across = 14;
  constexpr double typical_share = 0.4;
  constexpr double enough = elements / (across * across);
  std::sort(outlooks.begin(), outlooks.end(),
            [](const Outlook& a, const Outlook& b) { return a.free_path < b.free_path; });
  const auto squares = [](const Outlook& o) { return o.area / (o.free_path * o.free_path); };
  double rest = 0, weights = 0;
  for (const Outlook& o : outlooks) rest += squares(o), weights += o.weight;
  // Σ A min(1/c², 1/l²) falls as c grows: between two free paths it is passed / c² + rest.
  double typical = 0, passed = 0, passed_weights = 0;
  for (const Outlook& o : outlooks) {
    if (typical > 0 && passed / (o.free_path * o.free_path) + rest <= enough) break;
    passed += o.area, rest -= squares(o), passed_weights += o.weight;
    if (typical == 0 && passed_weights >= typical_share * weights) typical = o.free_path;
  }
  return std::max(typical, std::sqrt(passed / std::max(enough - rest, 1e-9 * enough)));
}

}  // namespace

void find_coarseness(const Scene& scene, const RayScene& rays, const Parallel& parallel, std::vector<LitSides>& lit) {
  const double extent = max_channel(bounds(scene).size());
  std::vector<double> free_paths(2 * lit.size(), 0);
  parallel.for_each(free_paths.size(), [&](std::size_t side) {
    const LitSides& sides = lit[side / 2];
    if ((side % 2 ? sides.back : sides.front) && scene.material_of(scene.surfaces[side / 2]).finish != Finish::glass)
      free_paths[side] = free_path(scene, rays, side, extent);
  });
  std::vector<Outlook> outlooks;
  for (std::size_t side = 0; side < free_paths.size(); ++side)
    if (const double path = free_paths[side]; path > 0) {
      const Surface& surface = scene.surfaces[side / 2];
      // The inside of a tubular lamp is no room.
      const bool is_lamp = scene.material_of(surface).emits();
      outlooks.push_back({surface.area, path, is_lamp ? 0 : std::min(1.0, surface.area / (path * path))});
    }
  if (outlooks.empty()) return;
  const double even = even_length(std::move(outlooks));
  const auto coarse = [&](double path) {
    return static_cast<std::uint8_t>(std::clamp(std::floor(std::log2(path / (2 * even))), 0.0, double{most_coarse}));
  };
  for (std::size_t s = 0; s < lit.size(); ++s) {
    lit[s].front_coarse = free_paths[2 * s] > 0 ? coarse(free_paths[2 * s]) : std::uint8_t{0};
    lit[s].back_coarse = free_paths[2 * s + 1] > 0 ? coarse(free_paths[2 * s + 1]) : std::uint8_t{0};
  }
}

}  // namespace lichthof
