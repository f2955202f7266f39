#include "bench/truth.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/random.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t points_at_once = 25;  // between two looks whether to stop
constexpr double on_surface = 1e-5;         // in sizes of the scene: points in files have 6 or 7 digits

bool holds(std::span<const Vec2> polygon, const Vec2& p) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec2 edge = polygon[(k + 1) % polygon.size()] - polygon[k], d = p - polygon[k];
    if (edge.x * d.y - edge.y * d.x < 0) return false;
  }
  return true;
}

}  // namespace

std::vector<SensorPoint> surface_points(const Mesh& mesh, std::size_t count, std::uint64_t seed) {
  std::vector<double> up_to;
  double total = 0;
  for (const Patch& patch : mesh.patches) {
    total += mesh.group_is_lit[patch.group.value] ? patch.area : 0;
    up_to.push_back(total);
  }
  MUST(total > 0);
  Random random(seed);
  std::vector<SensorPoint> points;
  while (points.size() < count) {
    const auto found = std::lower_bound(up_to.begin(), up_to.end() - 1, random.unit() * total);
    const Patch& patch = mesh.patches[static_cast<std::size_t>(found - up_to.begin())];
    const std::span<const Vec2> polygon = mesh.polygon(patch.polygon);
    Vec2 place;
    do {
      const double x = random.unit(), y = random.unit();
      place = patch.lo + (patch.hi - patch.lo) * Vec2{x, y};
    } while (!holds(polygon, place));
    const Plane& plane = mesh.planes[patch.plane.value];
    points.push_back({plane.point(place), plane.normal});
  }
  return points;
}

Expected<std::vector<Estimate>> path_traced(const BenchCase& scene, const PathTracer& tracer,
                                            std::span<const SensorPoint> points, std::uint32_t paths,
                                            std::uint64_t seed, const Parallel& parallel,
                                            const std::function<void(double)>& show) {
  std::vector<Estimate> estimates(points.size());
  for (std::size_t first = 0; first < points.size(); first += points_at_once) {
    if (show) show(static_cast<double>(first) / static_cast<double>(points.size()));
    parallel.for_each(std::min(points_at_once, points.size() - first), [&](std::size_t k) {
      std::uint64_t rays = 0;
      estimates[first + k] = tracer.irradiance(points[first + k], paths, mix64(seed) + first + k, rays);
    });
    if (scene.stopped()) return BenchCase::interrupted();
  }
  return estimates;
}

std::vector<Rgb> first_pass_irradiance(const LitScene& lit, std::span<const SensorPoint> points) {
  std::vector<Rgb> irradiance(points.size(), Rgb{0.0});
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const auto at = lit.trace().surface_below(points[i].point, points[i].normal, on_surface * lit.trace().size()))
      irradiance[i] = lit.total_irradiance(*at);
  return irradiance;
}

Estimate merged(const Estimate& first, double first_paths, const Estimate& second, double second_paths) {
  const double a = first_paths / (first_paths + second_paths), b = 1 - a;
  Estimate both;
  both.mean = a * first.mean + b * second.mean;
  for (int c = 0; c < 3; ++c)
    both.standard_error[c] = std::hypot(a * first.standard_error[c], b * second.standard_error[c]);
  return both;
}

double relative_error(std::span<const Rgb> some, std::span<const Estimate> truth) {
  MUST(some.size() == truth.size());
  double difference = 0, whole = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Rgb d = some[i] - truth[i].mean;
    difference += glm::dot(d, d), whole += glm::dot(truth[i].mean, truth[i].mean);
  }
  return whole > 0 ? std::sqrt(difference / whole) : 0;
}

double standard_error(std::span<const Estimate> truth) {
  double error = 0, whole = 0;
  for (const Estimate& t : truth)
    error += glm::dot(t.standard_error, t.standard_error), whole += glm::dot(t.mean, t.mean);
  return whole > 0 ? std::sqrt(error / whole) : 0;
}

double without_noise(double measured, double standard_error) {
  return std::sqrt(std::max(0.0, measured * measured - standard_error * standard_error));
}

}  // namespace lichthof::bench
