#include "core/tracing/check_points.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/scene/polygon.hpp"
#include "core/tracing/diffuse_landing.hpp"

namespace lichthof {

namespace {

/// Sensor points are written with 6 or 7 digits: this far from a surface counts as on it, in sizes of the scene.
constexpr double on_surface = 1e-5;
/// Where the tone curve of pictures reaches white, and the grey their average becomes (io/image_writer).
constexpr double white_of_curve = 7.24, key = 0.18;

double luminance(const Rgb& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

/// Radiance that makes white.
double white_of(const LitScene& scene, const std::vector<CheckPoint>& points, double exposure) {
  if (exposure > 0) return white_of_curve / exposure;
  double logs = 0, count = 0;
  for (const CheckPoint& point : points) {
    const double shown = luminance(point.share * scene.total_irradiance(point.at));
    if (shown > 0) logs += std::log(shown), ++count;
  }
  return count > 0 ? white_of_curve / key * std::exp(logs / count) : 1e300;
}

}  // namespace

CheckPoints sensor_check_points(const LitScene& scene, std::span<const SensorPoint> sensors, std::uint32_t most,
                                std::uint64_t seed) {
  CheckPoints places;
  places.is_all = sensors.size() <= most;
  const std::size_t count = std::min<std::size_t>(sensors.size(), most);
  const TraceScene& trace = scene.trace();
  const double tolerance = std::max(on_surface * trace.size(), 4 * trace.offset());
  Random random(seed, 23);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = sensors.size() * i / count, last = sensors.size() * (i + 1) / count;
    const SensorPoint& sensor = sensors[first + random.below(static_cast<std::uint32_t>(last - first))];
    const double length = glm::length(sensor.normal);
    if (!(length > 0) || !all_finite(sensor.point) || !all_finite(sensor.normal)) continue;
    const Vec3 normal = sensor.normal / length;
    const auto on = trace.surface_below(sensor.point, normal, tolerance);
    places.points.push_back({on.value_or(SurfacePoint{0, false, sensor.point, normal})});
    places.points.back().at.normal = normal;
  }
  return places;
}

CheckPoints picture_check_points(const LitScene& scene, const PinholeCamera& camera, double exposure,
                                 std::uint32_t most, std::uint64_t seed) {
  MUST(scene.has_solution());
  CheckPoints places;
  const TraceScene& trace = scene.trace();
  const Scene& input = trace.scene();
  const double aspect = static_cast<double>(camera.width()) / camera.height();
  const auto columns = std::clamp<std::uint32_t>(static_cast<std::uint32_t>(std::sqrt(most * aspect)), 1, most);
  const std::uint32_t rows = std::max(1u, most / columns);
  Random random(seed, 29);
  std::uint64_t rays = 0;
  for (std::uint32_t cell = 0; cell < columns * rows; ++cell) {
    const double x = random.unit(), y = random.unit();
    const Vec2 film{(cell % columns + x) / columns * camera.width(), (cell / columns + y) / rows * camera.height()};
    const Vec3 direction = camera.direction(film);
    const auto met = trace.nearest(camera.eye(), direction);
    if (!met || (!met->back && input.material_of(input.surfaces[met->surface]).emits())) continue;
    DiffuseLanding landing{*met, true};
    if (scatters_on(trace, met->surface)) follow(scene, landing, direction, random, rays);
    if (!landing.met) continue;
    const Rgb reflectance = reflectance_at(input, input.surfaces[landing.at.surface], landing.at.point);
    const Rgb share = landing.weight * reflectance * std::numbers::inv_pi;
    if (max_channel(share) > 0) places.points.push_back({landing.at, 1, share});
  }
  places.white = white_of(scene, places.points, exposure);
  return places;
}

CheckPoints surface_check_points(const LitScene& scene, std::uint32_t count, std::uint64_t seed) {
  MUST(scene.has_solution());
  const Scene& input = scene.trace().scene();
  const Mesh& mesh = scene.mesh();
  std::vector<const Patch*> patches;
  double area = 0;
  for (const Patch& patch : mesh.patches) {
    if (!mesh.group_is_lit[patch.group.value]) continue;
    if (input.material_of(input.surfaces[patch.surface.value]).finish == Finish::glass) continue;
    patches.push_back(&patch), area += patch.area;
  }
  CheckPoints places;
  places.norm = ErrorNorm::of_each;
  Random random(seed, 17);
  const double turn = random.unit();
  std::size_t next = 0;
  double up_to = patches.empty() ? 0 : patches[0]->area;
  for (std::uint32_t i = 0; i < count && !patches.empty(); ++i) {
    while (up_to < (i + turn) / count * area && next + 1 < patches.size()) up_to += patches[++next]->area;
    const Patch& patch = *patches[next];
    const Surface& surface = input.surfaces[patch.surface.value];
    const Plane& plane = mesh.planes[patch.plane.value];
    Polygon corners;
    for (const Vec2& corner : mesh.polygon(patch.polygon)) corners.push_back(plane.point(corner));
    places.points.push_back({{patch.surface.value, patch.back, random_place(corners, patch.area, random),
                              patch.back ? -surface.normal : surface.normal}});
  }
  return places;
}

}  // namespace lichthof
