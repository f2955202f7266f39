#include "core/tracing/probe.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"

namespace lichthof {

namespace {
/// Sensor points are written with 6 or 7 digits: this far from a surface counts as on it, in sizes of the scene.
constexpr double on_surface = 1e-5;
constexpr std::size_t points_per_task = 4;
/// Points that tell what paths would cost; shadow rays of each; an error that nobody asks to be smaller.
constexpr std::size_t most_looked_at = 48;
constexpr std::uint32_t path_direct_rays = 256;
constexpr double least_path_error = 0.003, most_path_error = 0.015;
/// What a first pass of default size costs, in rays of paths (0.2 µs): measured in rooms of 12 000 to 22 000 elements, 0.3 s, and in such a
/// room under a sky of 144 faces, 4 s. A tenth of a second is spent where it makes the error smaller.
constexpr double rays_of_shots = 1.5e6, rays_of_luminaire = 6e4, cheap_rays = 5e5;
/// Share of that for paths that start at all points alike, and how many those are at most at each.
constexpr double even_share = 0.25;
constexpr std::uint32_t most_even_paths = 2048;
/// Share of the points that a first look must find light at.
constexpr double least_lit = 0.75;

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

GatherOptions gather_options(const ProbeOptions& options) {
  GatherOptions gather = fixed_rays(options.gather_rays);
  if (options.gather_error) {
    gather.least = (std::max(1u, options.gather_rays) + 15) / 16 * 16;
    gather.most = GatherOptions{}.most;
    gather.error = *options.gather_error, gather.patience = options.patience;
  }
  return gather;
}

/// @param at  the surface that the point lies on, if any
PointLight light_at(const LitScene& scene, const FinalGather& gather, const std::optional<SurfacePoint>& at,
                    const Vec3& point, const Vec3& normal, std::uint64_t seed, const ProbeOptions& options,
                    std::uint64_t& rays) {
  DirectOptions direct = options.direct;
  direct.rounds = options.direct_rounds, direct.seed = mix64(seed);
  if (at && options.indirect == IndirectMethod::interpolate && scene.has_elements(*at))
    return {scene.direct().irradiance(point, normal, direct, rays), scene.indirect_irradiance(*at)};
  const DirectView view = scene.direct().view(point, normal, direct, rays);
  const GatheredLight light = gather.light(point, normal, view, seed ^ options.seed, rays);
  return {view.light + light.direct, light.indirect, std::sqrt(view.variance + light.variance) / 3};
}

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
  const FinalGather gather(scene, gather_options(options));
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
      light[i] = light_at(*scene, gather, at, point, normal, seeds.of(point, normal), options, rays_of_task[task]);
    }
  });
  for (const std::uint64_t count : rays_of_task) rays += count;
  return light;
}

std::optional<ProbeOptions> options_for_paths(std::shared_ptr<const LitScene> scene,
                                              std::span<const SensorPoint> points, const Parallel& parallel,
                                              std::uint64_t& rays) {
  // Shadow rays and chance find what matte surfaces reflect. Where whatever reflects also shines, shots have no noise at all.
  const Scene& input = scene->trace().scene();
  bool only_lamps = true;
  for (const Surface& surface : input.surfaces) {
    const Material& material = input.material_of(surface);
    if (material.finish != Finish::diffuse) return std::nullopt;
    only_lamps = only_lamps && (material.emits() || max_channel(material.reflectance) <= 0);
  }
  if (only_lamps || points.empty()) return std::nullopt;

  // A first look at some of the points: rays for an error e grow as 1/e².
  std::vector<SensorPoint> some;
  for (std::size_t i = 0; i < std::min(points.size(), most_looked_at); ++i)
    some.push_back(points[i * points.size() / std::min(points.size(), most_looked_at)]);
  ProbeOptions options = probe_options(GatherOptions{}.least, path_direct_rays);
  std::uint64_t spent = 0;
  double squares = 0, lit = 0;
  for (const PointLight& light : sensor_light(scene, some, options, parallel, spent)) {
    const double all = sum_channels(light.total()), own = all > 0 ? 3 * light.standard_error / all : 0.0;
    squares += own * own, lit += all > 0;
  }
  rays += spent;
  const double per_point = static_cast<double>(spent) / static_cast<double>(some.size());
  const double count = static_cast<double>(points.size());
  // Where much is dark, paths may not have found what lights it.
  if (lit < least_lit * static_cast<double>(some.size())) return std::nullopt;
  const double shots = rays_of_shots + rays_of_luminaire * static_cast<double>(scene->direct().luminaire_count());
  const double worth = per_point * count * squares / static_cast<double>(some.size());  // rays times squared error
  const double error = std::clamp(std::sqrt(worth / cheap_rays), least_path_error, most_path_error);
  if (std::max(per_point * count, worth / (error * error)) > shots) return std::nullopt;
  options.gather_error = error, options.patience = 0;
  // What all points can have for that is given to all: a lamp that outshines the rest must not hide how uncertain the rest is.
  const double for_all = even_share * cheap_rays / count / (per_point / GatherOptions{}.least);
  options.gather_rays = std::clamp(static_cast<std::uint32_t>(for_all), GatherOptions{}.least, most_even_paths);
  return options;
}

std::vector<Rgb> sensor_irradiance(std::shared_ptr<const LitScene> scene, std::span<const SensorPoint> points,
                                   const ProbeOptions& options, const Parallel& parallel, std::uint64_t& rays) {
  std::vector<Rgb> irradiance;
  for (const PointLight& light : sensor_light(std::move(scene), points, options, parallel, rays))
    irradiance.push_back(light.total());
  return irradiance;
}

}  // namespace lichthof
