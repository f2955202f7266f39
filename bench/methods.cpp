#include <algorithm>
#include <cmath>
#include <thread>

#include "bench/measure.hpp"
#include "bench/sections.hpp"
#include "core/base/random.hpp"
#include "core/tracing/path_tracer.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t point_count = 400, points_at_once = 25;
constexpr std::uint32_t paths_per_point = 2048;

bool holds(std::span<const Vec2> polygon, const Vec2& p) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec2 edge = polygon[(k + 1) % polygon.size()] - polygon[k], d = p - polygon[k];
    if (edge.x * d.y - edge.y * d.x < 0) return false;
  }
  return true;
}

/// Points uniform over the area of all patches that are lit.
std::vector<SensorPoint> surface_points(const Mesh& mesh) {
  std::vector<double> up_to;
  double total = 0;
  for (const Patch& patch : mesh.patches) {
    total += mesh.group_is_lit[patch.group.value] ? patch.area : 0;
    up_to.push_back(total);
  }
  Random random(31);
  std::vector<SensorPoint> points;
  while (points.size() < point_count) {
    const auto found = std::lower_bound(up_to.begin(), up_to.end() - 1, random.unit() * total);
    const Patch& patch = mesh.patches[static_cast<std::size_t>(found - up_to.begin())];
    const std::span<const Vec2> polygon = mesh.polygon(patch.polygon);
    Vec2 place;
    do place = patch.lo + (patch.hi - patch.lo) * Vec2{random.unit(), random.unit()};
    while (!holds(polygon, place));
    const Plane& plane = mesh.planes[patch.plane.value];
    points.push_back({plane.point(place), plane.normal});
  }
  return points;
}

/// RMS of the difference over the RMS of the truth.
double relative_error(const std::vector<Rgb>& some, const std::vector<Estimate>& truth) {
  double difference = 0, whole = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Rgb d = some[i] - truth[i].mean;
    difference += glm::dot(d, d), whole += glm::dot(truth[i].mean, truth[i].mean);
  }
  return whole > 0 ? std::sqrt(difference / whole) : 0;
}

double standard_error(const std::vector<Estimate>& truth) {
  double error = 0, whole = 0;
  for (const Estimate& t : truth)
    error += glm::dot(t.standard_error, t.standard_error), whole += glm::dot(t.mean, t.mean);
  return whole > 0 ? std::sqrt(error / whole) : 0;
}

/// What the first pass alone says at the points, and what the second makes of it.
struct Errors {
  double first_pass = 0, two_pass = 0;
};
Errors errors_of(const Solution& solution, const std::vector<SensorPoint>& points, const std::vector<Estimate>& truth,
                 const Parallel& parallel) {
  const auto lit = std::make_shared<const LitScene>(solution);
  std::vector<Rgb> first(points.size(), Rgb{0.0});
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const auto at = lit->trace().surface_below(points[i].point, points[i].normal, 1e-5 * lit->trace().size()))
      first[i] = lit->total_irradiance(*at);
  std::uint64_t rays = 0;
  ProbeOptions probe;
  probe.indirect = IndirectMethod::interpolate;
  return {relative_error(first, truth), relative_error(sensor_irradiance(lit, points, probe, parallel, rays), truth)};
}

}  // namespace

Expected<Section> methods_section(const BenchCase& scene) {
  const Parallel parallel(std::max(1u, std::thread::hardware_concurrency()));
  const std::vector<SensorPoint> points = surface_points(*scene.mesh());
  const PathTracer tracer(std::make_shared<const LitScene>(scene.scene()));
  std::vector<Estimate> truth;
  std::uint64_t rays = 0;
  for (std::size_t i = 0; i < points.size(); i += points_at_once) {
    const auto some = std::span(points).subspan(i, points_at_once);
    const std::vector<Estimate> part = reference_irradiance(tracer, some, paths_per_point, parallel, rays);
    truth.insert(truth.end(), part.begin(), part.end());
    if (scene.stopped()) return BenchCase::interrupted();
  }
  Section section{"methods", {}};
  double cpu[2] = {1e300, 1e300};
  Errors errors[2];
  for (unsigned round = 0; round < scene.repeat(); ++round)
    for (const int k : {0, 1}) {
      const Expected<Solved> solved = scene.solve("1", 1, k == 0 ? TransferMethod::rays : TransferMethod::hemicube);
      if (!solved) return solved.error();
      cpu[k] = std::min(cpu[k], solved->cpu_s);
      if (round == 0) errors[k] = errors_of(solved->solution, points, truth, parallel);
    }
  section.add("points", "random surface points", static_cast<double>(points.size()));
  section.add("reference_error", "standard error of path tracing there", standard_error(truth));
  section.add("rays/cpu_s", "shadow rays: CPU time of the radiosity pass", cpu[0], "s");
  section.add("hemicube/cpu_s", "hemicube R = 128: CPU time of the radiosity pass", cpu[1], "s");
  section.add("ratio", "CPU time, hemicube : shadow rays", cpu[1] / cpu[0], "", at_least(5));
  section.add("rays/first_pass_error", "shadow rays: RMS error of the first pass", errors[0].first_pass);
  section.add("hemicube/first_pass_error", "hemicube: RMS error of the first pass", errors[1].first_pass, "",
              at_least(errors[0].first_pass));
  section.add("rays/error", "shadow rays: RMS error with direct light by rays", errors[0].two_pass);
  section.add("hemicube/error", "hemicube: RMS error with direct light by rays", errors[1].two_pass, "",
              at_least(errors[0].two_pass));
  return section;
}

}  // namespace lichthof::bench
