#include "core/light/escape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/random.hpp"
#include "core/light/raycast.hpp"

namespace lichthof {

namespace {

constexpr std::uint32_t strata = 8;  // along each axis of the hemisphere's unit square
constexpr std::uint32_t rays_per_batch = strata * strata;
constexpr double extra_batches = 1024;
static_assert(rays_per_batch % 16 == 0, "whole packets");

/// Point of a convex polygon, uniform by area, for a point of the unit square.
Vec2 point_in(std::span<const Vec2> corners, double area, const Vec2& square) {
  double pick = square.x * area;
  for (std::size_t k = 2; k < corners.size(); ++k) {
    const Vec2 a = corners[k - 1] - corners[0], b = corners[k] - corners[0];
    const double part = 0.5 * (a.x * b.y - a.y * b.x);
    if (pick <= part || k + 1 == corners.size()) {
      const double s = part > 0 ? std::sqrt(std::clamp(pick / part, 0.0, 1.0)) : 0.0;
      return corners[0] + s * ((1 - square.y) * a + square.y * b);
    }
    pick -= part;
  }
  return corners[0];
}

/// Strata in random order, so that a ray's direction says nothing about its place.
std::array<std::uint32_t, rays_per_batch> shuffled_strata(Random& random) {
  std::array<std::uint32_t, rays_per_batch> order{};
  for (std::uint32_t k = 0; k < rays_per_batch; ++k) {
    const std::uint32_t place = random.below(k + 1);
    order[k] = order[place];
    order[place] = k;
  }
  return order;
}

/// How many of one batch of rays from the group meet nothing.
std::uint32_t open_rays(const Mesh& mesh, std::uint32_t index, std::uint32_t batch, const RayScene& rays) {
  const Group& group = mesh.groups[index];
  const Plane& plane = mesh.planes[group.plane.value];
  const std::span<const Vec2> corners = mesh.polygon(group.polygon);
  Random random(std::uint64_t{batch} << 32 | index);
  const Vec2 shift{random.unit(), random.unit()};
  const std::array<std::uint32_t, rays_per_batch> order = shuffled_strata(random);
  Segments16 segments;
  clear_segments(segments);
  RayScene::Hits16 hits;
  std::uint32_t open = 0;
  for (std::uint32_t first = 0; first < rays_per_batch; first += 16) {
    for (std::uint32_t lane = 0; lane < 16; ++lane) {
      const std::uint32_t stratum = order[first + lane];
      const Vec2 square{(stratum % strata + random.unit()) / strata, (stratum / strata + random.unit()) / strata};
      const Vec3 local = cosine_direction(square);
      const Vec3 direction = local.x * plane.u + local.y * plane.v + local.z * plane.normal;
      const Vec2 point = point_in(corners, group.area, r2_point(first + lane, shift));
      const Vec3 from = plane.point(point) + rays.offset() * plane.normal - rays.origin();
      segments.ox[lane] = static_cast<float>(from.x), segments.dx[lane] = static_cast<float>(direction.x);
      segments.oy[lane] = static_cast<float>(from.y), segments.dy[lane] = static_cast<float>(direction.y);
      segments.oz[lane] = static_cast<float>(from.z), segments.dz[lane] = static_cast<float>(direction.z);
    }
    rays.nearest16(segments, 0xffff, hits);
    for (const std::uint32_t surface : hits.surface) open += surface == RayScene::no_surface;
  }
  return open;
}

}  // namespace

std::vector<OpenShare> open_shares(const Scene& scene, const Mesh& mesh, std::span<const double> weights,
                                   const Parallel& parallel) {
  std::vector<OpenShare> shares(mesh.groups.size());
  if (scene.surfaces.empty()) return shares;
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  constexpr std::size_t groups_per_task = 16;
  double whole = 0;
  for (const double weight : weights) whole += weight;
  parallel.for_each((mesh.groups.size() + groups_per_task - 1) / groups_per_task, [&](std::size_t task) {
    const std::size_t end = std::min(mesh.groups.size(), (task + 1) * groups_per_task);
    for (std::size_t g = task * groups_per_task; g < end; ++g) {
      if (!mesh.group_is_lit[g] || !(weights[g] > 0)) continue;
      const auto index = static_cast<std::uint32_t>(g);
      std::uint32_t open = open_rays(mesh, index, 0, rays), batches = 1;
      if (open > 0)  // the larger its share of the light, the better it must be known
        for (; batches < std::ceil(extra_batches * weights[g] / whole); ++batches)
          open += open_rays(mesh, index, batches, rays);
      const double count = batches * rays_per_batch, share = open / count;
      shares[g] = {share, share * (1 - share) / count};
    }
  });
  return shares;
}

}  // namespace lichthof
