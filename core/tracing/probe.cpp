#include "core/tracing/probe.hpp"

#include <algorithm>
#include <bit>

#include "core/base/random.hpp"

namespace lichthof {

namespace {
/// Sensor points are written with 6 or 7 digits: this far from a surface counts as on it, in sizes of the scene.
constexpr double on_surface = 1e-5;
constexpr std::size_t points_per_task = 16;

/// The same place gives the same rays, in whatever row of the list it stands.
std::uint64_t seed_of(const Vec3& point, const Vec3& normal) {
  std::uint64_t seed = 0;
  for (int axis = 0; axis < 3; ++axis)
    seed = mix64(seed ^ std::bit_cast<std::uint64_t>(point[axis])) + std::bit_cast<std::uint64_t>(normal[axis]);
  return seed;
}
}  // namespace

std::vector<PointLight> sensor_light(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                     const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays) {
  const FinalGather gather(scene, options.gather_rays);
  const std::size_t tasks = (points.size() + points_per_task - 1) / points_per_task;
  std::vector<PointLight> light(points.size());
  std::vector<std::uint64_t> rays_of_task(tasks, 0);
  parallel.for_each(tasks, [&](std::size_t task) {
    const std::size_t last = std::min(points.size(), (task + 1) * points_per_task);
    for (std::size_t i = task * points_per_task; i < last; ++i) {
      const double length = glm::length(points[i].normal);
      if (!(length > 0) || !all_finite(points[i].point) || !all_finite(points[i].normal)) continue;
      const Vec3 normal = points[i].normal / length;
      const TraceScene& trace = scene->trace();
      const auto at =
          trace.surface_below(points[i].point, normal, std::max(on_surface * trace.size(), 4 * trace.offset()));
      const Vec3 point = at ? at->point : points[i].point;
      const std::uint64_t seed = seed_of(point, normal);
      DirectOptions direct = options.direct;
      for (std::uint32_t round = 0; round < options.direct_rounds; ++round) {
        direct.seed = mix64(seed + round);
        light[i].direct += scene->direct().irradiance(point, normal, direct, rays_of_task[task]);
      }
      light[i].direct /= static_cast<double>(options.direct_rounds);
      light[i].indirect = at && options.indirect == IndirectMethod::interpolate && scene->has_elements(*at)
                              ? scene->indirect_irradiance(*at)
                              : gather.irradiance(point, normal, seed ^ options.seed, rays_of_task[task]);
    }
  });
  for (const std::uint64_t count : rays_of_task) rays += count;
  return light;
}

std::vector<Rgb> sensor_irradiance(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                   const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays) {
  std::vector<Rgb> irradiance;
  for (const PointLight& light : sensor_light(std::move(scene), points, options, parallel, rays))
    irradiance.push_back(light.total());
  return irradiance;
}

}  // namespace lichthof
