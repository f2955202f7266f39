#include "bench/bench_case.hpp"

#include <cmath>
#include <utility>

#include "bench/measure.hpp"
#include "core/light/lit_sides.hpp"
#include "core/scene/partition.hpp"
#include "core/tracing/column_tracer.hpp"

namespace lichthof::bench {

namespace {

constexpr std::uint32_t picture_width = 640, picture_height = 480;

std::shared_ptr<const Mesh> default_mesh(const Scene& scene) {
  MeshOptions options;
  options.patch_size = scene.patch_size.value_or(0);
  double area = 0;
  for (const Surface& surface : scene.surfaces) area += surface.area;
  const double block = options.patch_size > 0 ? 2 * options.patch_size : 8 * std::sqrt(area / options.target_elements);
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  return std::make_shared<const Mesh>(mesh_of(scene, options, lit_sides(scene, rays, block, Parallel(1))));
}

}  // namespace

BenchCase::BenchCase(std::shared_ptr<const Scene> scene, unsigned repeat, const std::atomic<bool>& stop)
    : scene_(std::move(scene)), mesh_(default_mesh(*scene_)), repeat_(repeat), stop_(stop) {}

Expected<Solved> BenchCase::solve(const std::string& cells, unsigned threads, TransferMethod method) const {
  const Expected<CellsWanted> wanted = cells_wanted(cells);
  if (!wanted) return wanted.error();
  Expected<CellGrid> grid = partition(*mesh_, bounds(*scene_), *wanted);
  if (!grid) return grid.error();
  actors::SolveRun run;
  run.scene = scene_;
  run.mesh = mesh_;
  run.grid = std::make_shared<const CellGrid>(std::move(*grid));
  run.options.method = method;
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
