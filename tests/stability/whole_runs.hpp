/// Whole runs on scenes built in code, as the program makes them: mesh of the lit sides, cells as actors, second pass. And what
/// a scene becomes when it is turned, made larger or carried off.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/mat3x3.hpp>
#include <memory>
#include <numbers>
#include <string_view>
#include <vector>

#include "actors/local_run.hpp"
#include "core/light/lit_sides.hpp"
#include "core/light/raycast.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/probe.hpp"
#include "tests/support/rooms.hpp"

namespace lichthof::test {

/// True when the trials are to be as large as the promises say, not as short as the gate wants them.
inline bool long_trials() {
  const char* trials = std::getenv("LICHTHOF_TRIALS");
  return trials != nullptr && std::string_view(trials) == "long";
}

struct Wanted {
  double patch_size = 0;  ///< m; 0: from `elements`
  std::uint32_t elements = 1500;
  CellPosition cells{1, 1, 1};
  double eps = 5e-4;
  unsigned threads = 1;
};

inline std::shared_ptr<const Mesh> lit_mesh(const Scene& scene, const Wanted& wanted) {
  MeshOptions options;
  options.patch_size = wanted.patch_size;
  options.target_elements = wanted.elements;
  double area = 0;
  for (const Surface& surface : scene.surfaces) area += surface.area;
  const double block = wanted.patch_size > 0 ? 2 * wanted.patch_size : 8 * std::sqrt(area / wanted.elements);
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  return std::make_shared<const Mesh>(mesh_of(scene, options, lit_sides(scene, rays, block, Parallel(wanted.threads))));
}

inline Solution solved(const std::shared_ptr<const Scene>& scene, const std::shared_ptr<const Mesh>& mesh,
                       const Wanted& wanted) {
  CellsWanted cells;
  cells.count = wanted.cells[0] * wanted.cells[1] * wanted.cells[2];
  cells.along = wanted.cells;
  Expected<CellGrid> grid = partition(*mesh, bounds(*scene), cells);
  REQUIRE(grid);
  actors::SolveRun run;
  run.scene = scene, run.mesh = mesh;
  run.grid = std::make_shared<const CellGrid>(std::move(*grid));
  run.options.mesh = mesh->options;
  run.options.cells = wanted.cells;
  run.options.eps = wanted.eps;
  run.parallel = std::make_shared<const Parallel>(wanted.threads);
  Solution solution = actors::solve(run);
  REQUIRE(solution.converged);
  return solution;
}

inline Solution solved(const std::shared_ptr<const Scene>& scene, const Wanted& wanted) {
  return solved(scene, lit_mesh(*scene, wanted), wanted);
}

/// What `lichthof probe` writes.
inline std::vector<Rgb> light_at(const Solution& solution, std::span<const SensorPoint> points,
                                 const ProbeOptions& options = {}) {
  std::uint64_t rays = 0;
  return sensor_irradiance(std::make_shared<LitScene>(solution), points, options, Parallel(1), rays);
}
/// The same without a gather, whose rays another place draws anew: what `lichthof probe --gather 0` writes.
inline std::vector<Rgb> light_without_chance(const Solution& solution, std::span<const SensorPoint> points) {
  ProbeOptions options;
  options.indirect = IndirectMethod::interpolate;
  return light_at(solution, points, options);
}

/// Every point p of a scene comes to place + size · turn · p.
struct Carriage {
  double size = 1;
  Vec3 place{0.0};
  glm::dmat3 turn{1.0};
  Vec3 operator()(const Vec3& p) const { return place + size * (turn * p); }
};

/// A turn about no axis in particular.
inline glm::dmat3 tilted() {
  const Vec3 x = glm::normalize(Vec3{0.81, 0.52, 0.27}), z = glm::normalize(glm::cross(x, Vec3{0.2, 0.9, -0.3}));
  return {x, glm::cross(z, x), z};
}

inline std::shared_ptr<const Scene> carried(Scene scene, const Carriage& carriage) {
  for (Surface& surface : scene.surfaces) {
    for (Vec3& corner : surface.corners) corner = carriage(corner);
    surface.normal = glm::normalize(newell_vector(surface.corners));
    surface.area = area(surface.corners);
  }
  return std::make_shared<const Scene>(std::move(scene));
}

inline std::vector<SensorPoint> carried(std::vector<SensorPoint> points, const Carriage& carriage) {
  for (SensorPoint& at : points) at = {carriage(at.point), carriage.turn * at.normal};
  return points;
}

/// Root of the mean square of a - b over that of b, all channels.
inline double rms_difference(std::span<const Rgb> a, std::span<const Rgb> b) {
  REQUIRE(a.size() == b.size());
  double difference = 0, whole = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference += glm::dot(a[i] - b[i], a[i] - b[i]), whole += glm::dot(b[i], b[i]);
  return std::sqrt(difference / whole);
}

inline double largest_difference(std::span<const Rgb> a, std::span<const Rgb> b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Rgb d = glm::abs(a[i] - b[i]);
    worst = std::max(worst, max_channel(d) / max_channel(b[i]));
  }
  return worst;
}

/// Irradiance of a solution per element, the light still to come included.
inline std::vector<Rgb> element_light(const Solution& solution) {
  std::vector<Rgb> light;
  for (std::size_t e = 0; e < solution.irradiance.size(); ++e)
    light.push_back(Rgb{solution.irradiance[e]} + Rgb{solution.pending[e]});
  return light;
}

/// Area mean of the indirect irradiance on all lit elements, first channel (W/m²).
inline double mean_indirect(const Solution& solution) {
  double sum = 0, area = 0;
  for (const Patch& patch : solution.mesh->patches) {
    if (!solution.mesh->group_is_lit[patch.group.value]) continue;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      sum += solution.mesh->elements[e].area * solution.indirect(e).x;
      area += solution.mesh->elements[e].area;
    }
  }
  return sum / area;
}

/// A grid of points on the six faces of a box, looking inwards.
inline std::vector<SensorPoint> points_inside(const Vec3& lo, const Vec3& hi, std::span<const double> places) {
  std::vector<SensorPoint> points;
  for (int axis = 0; axis < 3; ++axis)
    for (const double a : places)
      for (const double b : places)
        for (const bool high : {false, true}) {
          Vec3 share{0.0}, normal{0.0};
          share[axis] = high ? 1 : 0, share[(axis + 1) % 3] = a, share[(axis + 2) % 3] = b;
          normal[axis] = high ? -1 : 1;
          points.push_back({lo + share * (hi - lo), normal});
        }
  return points;
}

}  // namespace lichthof::test
