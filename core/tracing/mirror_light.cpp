#include "core/tracing/mirror_light.hpp"

#include <algorithm>

#include "core/tracing/mirror_images.hpp"
#include "core/tracing/trace_scene.hpp"

namespace lichthof {

namespace {

constexpr std::uint32_t rays_per_image = 4;

bool has_mirrors(const Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(),
                     [](const Material& material) { return material.finish == Finish::mirror; });
}

}  // namespace

std::optional<Solution> light_by_mirrors(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh,
                                         const SolveOptions& options, const Parallel& parallel) {
  if (options.method == TransferMethod::hemicube || !has_mirrors(*scene)) return std::nullopt;
  const MirrorImages images(std::make_shared<const TraceScene>(scene));
  if (images.empty()) return std::nullopt;
  Solution solution;
  solution.scene = std::move(scene), solution.mesh = std::move(mesh), solution.options = options;
  const Mesh& cut = *solution.mesh;
  for (auto* values : {&solution.irradiance, &solution.direct_irradiance, &solution.shot, &solution.pending})
    values->assign(cut.elements.size(), Rgbf{0.f});
  std::vector<double> arriving_w(cut.groups.size(), 0);
  parallel.for_each(cut.groups.size(), [&](std::size_t g) {
    if (!cut.group_is_lit[g]) return;
    const Group& group = cut.groups[g];
    const Plane& plane = cut.planes[group.plane.value];
    std::uint64_t rays = 0;
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
      for (std::uint32_t k = 0; k < cut.patches[p].element_count; ++k) {
        const std::uint32_t e = cut.patches[p].first_element + k;
        const Rgb irradiance =
            images.irradiance(plane.point(cut.elements[e].centre), plane.normal, rays_per_image, e, rays);
        solution.irradiance[e] = solution.direct_irradiance[e] = Rgbf{irradiance};
        arriving_w[g] += cut.elements[e].area * sum_channels(irradiance);
      }
  });
  for (const double power : arriving_w) solution.energy.mirrored += power;
  return solution;
}

}  // namespace lichthof
