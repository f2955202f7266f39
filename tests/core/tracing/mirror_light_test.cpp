#include "core/tracing/mirror_light.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "core/tracing/path_tracer.hpp"
#include "core/tracing/probe.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// A grey room of 4 x 4 x 3 m with a mirror on the wall x = 0 and a panel that shines at the mirror alone.
std::shared_ptr<const Scene> mirror_room() {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {4, 4, 3}, add_material(*scene, diffuse(0.5)), true);
  add_rectangle(*scene, {0.01, 0.5, 0.3}, {0, 3, 0}, {0, 0, 2.4}, add_material(*scene, specular(Finish::mirror, 0.8)));
  add_rectangle(*scene, {0.5, 1.5, 1}, {0, 0, 1}, {0, 1, 0}, add_material(*scene, luminous(10)));
  return scene;
}

}  // namespace

TEST_CASE("mirror_light: what a luminaire sends by a mirror is shot on, and the energy ledger closes") {
  const std::shared_ptr<const Scene> scene = mirror_room();
  OneCell cell(scene, test::mesh_with(*scene, 0.4));
  const std::optional<Solution> begun = light_by_mirrors(scene, cell.mesh, {}, Parallel(1));
  REQUIRE(begun);
  cell.light.load(*begun);
  const double emitted = sum_channels(cell.light.power().emitted);
  // All but what the mirror keeps, and what passes beside it; and part of what walls send to the mirror later.
  CHECK(begun->energy.mirrored_direct > 0.7 * emitted);
  CHECK(begun->energy.mirrored_direct < 0.8 * emitted);
  CHECK(begun->energy.mirrored > 1.05 * begun->energy.mirrored_direct);
  cell.solve(1e-5);
  const CellPower power = cell.light.power();
  const double absorbed = sum_channels(power.absorbed) - begun->energy.mirrored;
  const double residual = (emitted - absorbed - sum_channels(power.unshot)) / emitted;
  INFO("residual " << residual);
  // Measured -2e-3 at this mesh.
  CHECK(std::abs(residual) < 0.01);
}

TEST_CASE("mirror_light: behind the luminaire, where nothing comes straight, the two passes agree with path tracing") {
  const std::shared_ptr<const Scene> scene = mirror_room();
  std::vector<SensorPoint> points;
  for (const double x : {0.1, 0.25, 0.4})
    for (const double y : {0.4, 1.2, 2.0, 2.8, 3.6}) points.push_back({{x, y, 0}, {0, 0, 1}});
  const auto light_of = [&](bool by_mirrors) {
    OneCell cell(scene, test::mesh_with(*scene, 0.4));
    if (by_mirrors) cell.light.load(*light_by_mirrors(scene, cell.mesh, {}, Parallel(1)));
    cell.solve(1e-5);
    ProbeOptions options;
    options.gather_rays = 1024;
    std::uint64_t rays = 0;
    double sum = 0;
    for (const Rgb& light :
         sensor_irradiance(std::make_shared<const LitScene>(cell.solution()), points, options, Parallel(1), rays))
      sum += light.x;
    return sum;
  };
  const PathTracer tracer(std::make_shared<const LitScene>(scene));
  std::uint64_t rays = 0;
  double wanted = 0, variance = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Estimate estimate = tracer.irradiance(points[i], 1 << 15, i, rays);
    wanted += estimate.mean.x, variance += estimate.standard_error.x * estimate.standard_error.x;
  }
  const double with = light_of(true) / wanted - 1, without = light_of(false) / wanted - 1;
  MESSAGE("with " << with << ", without " << without << ", noise of path tracing " << std::sqrt(variance) / wanted);
  CHECK(std::abs(with) < 0.01);
  CHECK(without < -0.1);
}

TEST_CASE("mirror_light: none without mirrors") {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {4, 4, 3}, add_material(*scene, diffuse(0.5)), true);
  add_rectangle(*scene, {1, 1, 2.9}, {0, 1, 0}, {1, 0, 0}, add_material(*scene, luminous(10)));
  CHECK_FALSE(light_by_mirrors(scene, test::mesh_with(*scene, 1), {}, Parallel(1)));
}
