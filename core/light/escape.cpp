#include "core/light/escape.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/light/group_rays.hpp"

namespace lichthof {

namespace {

constexpr double extra_batches = 1024;

/// How many of one batch of rays from the group meet nothing.
std::uint32_t open_rays(const Mesh& mesh, std::uint32_t group, std::uint32_t batch, const RayScene& rays) {
  GroupRays cast;
  cast_from_group(mesh, group, batch, rays, cast);
  return static_cast<std::uint32_t>(std::ranges::count(cast.surface, RayScene::no_surface));
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
      const double count = batches * GroupRays::count, share = open / count;
      // Where all rays leave, one of as many again might not.
      const double likely = open > 0 ? (open + 1) / (count + 2) : 0;
      shares[g] = {share, likely * (1 - likely) / count};
    }
  });
  return shares;
}

}  // namespace lichthof
