#include "core/tracing/probe.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"

namespace lichthof {

namespace {
/// Sensor points are written with 6 or 7 digits: this far from a surface counts as on it, in sizes of the scene.
constexpr double on_surface = 1e-5;
constexpr std::size_t points_per_task = 16;

/// Seeds of places. The same place has the same one, in whatever row of the list it stands, and in whatever unit and place the
/// scene is given: rounded to 2^-16 of the scene, it is left alone by the rounding of coordinates.
class PlaceSeeds {
 public:
  explicit PlaceSeeds(const Scene& scene) {
    const Box box = bounds(scene);
    lo_ = box.lo;
    const double extent = std::max({box.size().x, box.size().y, box.size().z});
    per_metre_ = extent > 0 ? steps / extent : 0;
  }
  std::uint64_t of(const Vec3& point, const Vec3& normal) const {
    std::uint64_t seed = 0;
    for (int axis = 0; axis < 3; ++axis) {
      seed = mix64(seed ^ rounded((point[axis] - lo_[axis]) * per_metre_));
      seed = mix64(seed ^ rounded(normal[axis] * steps));
    }
    return seed;
  }

 private:
  static constexpr double steps = 65536;
  /// Points in free air may be anywhere.
  static std::uint64_t rounded(double value) {
    return static_cast<std::uint64_t>(std::llround(std::clamp(value, -1e15, 1e15)));
  }
  Vec3 lo_{0.0};
  double per_metre_ = 0;
};

}  // namespace

ProbeOptions probe_options(std::uint32_t gather_rays, std::uint32_t direct_rays) {
  ProbeOptions options;
  options.indirect = gather_rays > 0 ? IndirectMethod::gather : IndirectMethod::interpolate;
  if (gather_rays > 0) options.gather_rays = gather_rays;
  // A luminaire has 64 parts at most: more rays than that go to other places of the same parts.
  constexpr std::uint32_t most_at_once = 256;
  options.direct.rays = std::min(direct_rays, most_at_once);
  options.direct.most_per_luminaire = direct_rays < most_at_once ? 16 : 64;
  options.direct_rounds = std::max(1u, direct_rays / most_at_once);
  return options;
}

std::vector<PointLight> sensor_light(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                     const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays) {
  const FinalGather gather(scene, options.gather_rays);
  const PlaceSeeds seeds(scene->trace().scene());
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
      const std::uint64_t seed = seeds.of(point, normal);
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
