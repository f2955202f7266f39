#include <algorithm>
#include <thread>

#include "bench/measure.hpp"
#include "bench/sections.hpp"
#include "bench/truth.hpp"
#include "core/tracing/probe.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t point_count = 400;
constexpr std::uint64_t seed = 31;
constexpr std::uint32_t paths_per_point = 2048;

/// What the first pass alone says at the points, and what the second makes of it.
struct Errors {
  double first_pass = 0, two_pass = 0;
};
Errors errors_of(const Solution& solution, const std::vector<SensorPoint>& points, const std::vector<Estimate>& truth,
                 const Parallel& parallel) {
  const auto lit = std::make_shared<const LitScene>(solution);
  const std::vector<Rgb> first = first_pass_irradiance(*lit, points);
  std::uint64_t rays = 0;
  ProbeOptions probe;
  probe.indirect = IndirectMethod::interpolate;
  return {relative_error(first, truth), relative_error(sensor_irradiance(lit, points, probe, parallel, rays), truth)};
}

}  // namespace

Expected<Section> methods_section(const BenchCase& scene) {
  const Parallel parallel(std::max(1u, std::thread::hardware_concurrency()));
  const std::vector<SensorPoint> points = surface_points(*scene.mesh(), point_count, seed);
  const PathTracer tracer(std::make_shared<const LitScene>(scene.scene()));
  const Expected<std::vector<Estimate>> traced = path_traced(scene, tracer, points, paths_per_point, seed, parallel);
  if (!traced) return traced.error();
  const std::vector<Estimate>& truth = *traced;
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
