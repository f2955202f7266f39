#include "core/tracing/final_gather.hpp"

#include <doctest/doctest.h>

#include <numbers>

#include "core/tracing/path_tracer.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

TEST_CASE("final_gather: in a furnace every ray sees ρH, whatever the point") {
  const Furnace furnace(1, 0.5);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  const FinalGather gather(scene, 256);
  std::uint64_t rays = 0;
  for (const Vec3& point : {Vec3{0.5, 0.5, 0}, Vec3{1e-6, 0.3, 0}, Vec3{0.2, 0.9, 0.4}})
    CHECK(gather.irradiance(point, {0, 0, 1}, 1, rays).x == doctest::Approx(0.5 * furnace.total()).epsilon(1e-6));
  CHECK(rays >= 3 * 256);
}

TEST_CASE("final_gather: in a narrow gap the light is found by going on, whatever the elements say") {
  // Two plates 2 cm apart in a luminous box, elements of 25 cm; their values are nonsense on purpose.
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {4, 4, 4}, add_material(*scene, luminous(1)), true);
  const std::uint32_t grey = add_material(*scene, diffuse(0.5));
  add_rectangle(*scene, {1, 1, 2}, {2, 0, 0}, {0, 2, 0}, grey);
  add_rectangle(*scene, {1, 1, 2.02}, {0, 2, 0}, {2, 0, 0}, grey);
  const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 0.25, 1000, 0));
  const FinalGather gather(lit, 1024);
  std::uint64_t rays = 0;
  // Answered by elements it would be 500. Only rays that travel half an element sideways, 1 in 40 per bounce, still are.
  CHECK(gather.irradiance({2, 2, 2}, {0, 0, 1}, 1, rays).x < 40);
}

TEST_CASE("final_gather: half of the view bright gives half of the light") {
  // The floor of a room whose walls and ceiling reflect nothing but for x > 2; a point in the middle sees half of that.
  auto scene = std::make_shared<Scene>();
  const std::uint32_t black = add_material(*scene, diffuse(0)), white = add_material(*scene, diffuse(0.8));
  add_box(*scene, {0, 0, 0}, {2, 4, 3}, black, true);
  scene->surfaces.erase(scene->surfaces.begin() + 1);
  add_box(*scene, {2, 0, 0}, {4, 4, 3}, white, true);
  scene->surfaces.erase(scene->surfaces.begin() + 5);
  const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 0.25, 10, 0));
  const FinalGather gather(lit, 1024);
  std::uint64_t rays = 0;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) sum += gather.irradiance({2, 2, 0}, {0, 0, 1}, seed, rays).x;
  CHECK(sum / 16 == doctest::Approx(0.5 * 0.8 * 10).epsilon(0.005));
}

TEST_CASE("final_gather: a luminaire counts by way of gloss, not on the ways that shadow rays know") {
  // A mirror stands at x = 0; the panel hangs over x = 2; everything else is black.
  double by_paths = 0;
  const auto seen = [&by_paths](const Material& material, double& direct) {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t mirror = add_material(*scene, material), panel = add_material(*scene, luminous(7));
    add_rectangle(*scene, {0, -50, 0}, {0, 100, 0}, {0, 0, 100}, mirror);
    add_rectangle(*scene, {1, 1, 2}, {2, 0, 0}, {0, -2, 0}, panel);
    const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 5, 0, 0));
    std::uint64_t rays = 0;
    direct = lit->direct().irradiance({1, 0, 0}, {0, 0, 1}, {}, rays).x;
    by_paths = PathTracer(lit).irradiance({{1, 0, 0}, {0, 0, 1}}, 1 << 18, 1, rays).mean.x;
    return FinalGather(lit, 4096).irradiance({1, 0, 0}, {0, 0, 1}, 3, rays).x;
  };
  // The mirror shows the panel at -3 < x < -1: light as from a panel there, times 0.9.
  const auto from = [](double x) {
    auto image = std::make_shared<Scene>();
    add_rectangle(*image, {x, 1, 2}, {2, 0, 0}, {0, -2, 0}, add_material(*image, luminous(7)));
    std::uint64_t rays = 0;
    return DirectLight(std::make_shared<TraceScene>(image)).irradiance({1, 0, 0}, {0, 0, 1}, {}, rays).x;
  };
  double direct = 0;
  CHECK(seen(specular(Finish::mirror, 0.9), direct) == 0);
  CHECK(direct == doctest::Approx(from(1) + 0.9 * from(-3)).epsilon(1e-6));
  CHECK(std::abs(direct / by_paths - 1) < 0.01);
  const double glossy = seen(specular(Finish::glossy, 0.9, 0, 50), direct);
  CHECK(direct == doctest::Approx(from(1)).epsilon(1e-6));
  CHECK(glossy > 0.1 * direct);
  CHECK(std::abs((glossy + direct) / by_paths - 1) < 0.01);
}

TEST_CASE("final_gather: a pane hides the luminaire behind it, since shadow rays count that light") {
  auto scene = std::make_shared<Scene>();
  add_rectangle(*scene, {-9, 9, 2}, {18, 0, 0}, {0, -18, 0}, add_material(*scene, luminous(7)));
  add_rectangle(*scene, {-9, 9, 1}, {18, 0, 0}, {0, -18, 0}, add_material(*scene, glass(1.5)));
  const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 5, 0, 0));
  const FinalGather gather(lit, 256);
  std::uint64_t rays = 0;
  CHECK(gather.irradiance({0, 0, 0}, {0, 0, 1}, 3, rays).x == 0.0);
}
