#include "bench/bench_case.hpp"

#include <cmath>
#include <utility>

#include "bench/measure.hpp"
#include "core/light/lit_sides.hpp"
#include "core/light/refinement.hpp"
#include "core/tracing/column_tracer.hpp"

namespace lichthof::bench {

namespace {

constexpr std::uint32_t picture_width = 640, picture_height = 480;

/// As the commands cut it: @param options  with a patch size or a number of elements
std::shared_ptr<const Mesh> meshed(const Scene& scene, const MeshOptions& options) {
  double area = 0;
  for (const Surface& surface : scene.surfaces) area += surface.area;
  const double block = options.patch_size > 0 ? 2 * options.patch_size : 8 * std::sqrt(area / options.target_elements);
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  return std::make_shared<const Mesh>(mesh_of(scene, options, lit_sides(scene, rays, block, Parallel(1))));
}

std::shared_ptr<const Mesh> default_mesh(const Scene& scene) {
  MeshOptions options;
  options.patch_size = scene.patch_size.value_or(0);
  return meshed(scene, options);
}

}  // namespace

BenchCase::BenchCase(std::shared_ptr<const Scene> scene, unsigned repeat, const std::atomic<bool>& stop)
    : scene_(std::move(scene)), mesh_(default_mesh(*scene_)), repeat_(repeat), stop_(stop) {}

Expected<Solved> BenchCase::solve_on(std::shared_ptr<const Mesh> mesh, SolveOptions options, const CellsWanted& cells,
                                     unsigned threads) const {
  Expected<CellGrid> grid = partition(*mesh, bounds(*scene_), cells);
  if (!grid) return grid.error();
  actors::SolveRun run;
  run.scene = scene_;
  run.mesh = std::move(mesh);
  run.grid = std::make_shared<const CellGrid>(std::move(*grid));
  run.options = options;
  run.options.cells = run.grid->size();
  run.parallel = std::make_shared<const Parallel>(threads);
  run.stop = &stop_;
  Solved solved;
  const double cpu = cpu_s(), wall = wall_s();
  solved.solution = actors::solve(run);
  solved.cpu_s = cpu_s() - cpu;
  solved.wall_s = wall_s() - wall;
  if (stopped()) return interrupted();
  return solved;
}

Expected<Solved> BenchCase::solve(const std::string& cells, unsigned threads, TransferMethod method) const {
  const Expected<CellsWanted> wanted = cells_wanted(cells);
  if (!wanted) return wanted.error();
  SolveOptions options;
  options.method = method;
  return solve_on(mesh_, options, *wanted, threads);
}

Expected<Solved> BenchCase::solve_meshed(const SolveOptions& options,
                                         const std::function<std::shared_ptr<const Mesh>()>& make_mesh) const {
  const double cpu = cpu_s(), wall = wall_s();
  Expected<Solved> solved = solve_on(make_mesh(), options, {}, 1);
  if (!solved) return solved.error();
  solved->cpu_s = cpu_s() - cpu;
  solved->wall_s = wall_s() - wall;
  return solved;
}

Expected<Solved> BenchCase::solve_with(std::uint32_t elements, double eps, TransferMethod method,
                                       std::uint32_t fineness) const {
  SolveOptions options;
  options.mesh.target_elements = elements;
  options.eps = eps;
  options.method = method;
  return solve_meshed(options, [&] {
    std::shared_ptr<const Mesh> mesh = meshed(*scene_, options.mesh);
    if (fineness == 1) return mesh;
    MeshOptions finer = mesh->options;
    finer.element_size /= fineness;
    return std::make_shared<const Mesh>(mesh_of(*scene_, finer, mesh->lit_sides));
  });
}

Expected<Solved> BenchCase::solve_refined(std::uint32_t elements, double eps, double keep) const {
  SolveOptions options;
  options.mesh.target_elements = elements;
  options.eps = eps;
  return solve_meshed(options, [&] { return refined_mesh(scene_, meshed(*scene_, options.mesh), keep, Parallel(1)); });
}

Expected<const Solution*> BenchCase::solution() const {
  if (!solution_) {
    Expected<Solved> solved = solve();
    if (!solved) return solved.error();
    solution_ = std::make_shared<const Solution>(std::move(solved->solution));
  }
  return solution_.get();
}

Expected<std::shared_ptr<const ColumnSource>> BenchCase::picture() const {
  const Expected<const Solution*> solved = solution();
  if (!solved) return solved.error();
  const auto lit = std::make_shared<const LitScene>(**solved);
  const Camera wanted = scene_->cameras.empty()
                            ? framing_camera(lit->trace(), static_cast<double>(picture_width) / picture_height)
                            : scene_->cameras.front();
  const Expected<Camera> camera = checked(wanted);
  if (!camera) return camera.error();
  return std::shared_ptr<const ColumnSource>(
      std::make_shared<ColumnTracer>(lit, PinholeCamera(*camera, picture_width, picture_height), TracingOptions{},
                                     std::make_shared<const Parallel>(1)));
}

Expected<actors::TraceResult> BenchCase::trace(const std::shared_ptr<const ColumnSource>& source, unsigned workers,
                                               Scheduling scheduling) const {
  actors::TraceRun run;
  run.source = source;
  run.workers = workers;
  run.scheduling = scheduling;
  run.stop = &stop_;
  actors::TraceResult result = actors::trace(run);
  if (stopped() || !result.complete) return interrupted();
  return result;
}

}  // namespace lichthof::bench
