#include "core/tracing/final_gather.hpp"

#include <doctest/doctest.h>

#include <numbers>

#include "core/light/form_factor.hpp"
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

namespace {

/// Relative deviations of the light at the origin, seen upwards, from what is right, for many seeds.
struct Deviations {
  double mean = 0, rms = 0, said = 0;  ///< said: RMS of the standard errors
  Deviations(const std::shared_ptr<const LitScene>& lit, double right, int seeds = 64) {
    const FinalGather gather(lit, GatherOptions{});
    std::uint64_t rays = 0;
    for (int seed = 0; seed < seeds; ++seed) {
      DirectOptions options;
      options.seed = static_cast<std::uint64_t>(seed);
      const DirectView view = lit->direct().view({0, 0, 0}, {0, 0, 1}, options, rays);
      const GatheredLight light = gather.light({0, 0, 0}, {0, 0, 1}, view, static_cast<std::uint64_t>(seed), rays);
      const double error = sum_channels(view.light + light.direct + light.indirect) / (3 * right) - 1;
      mean += error / seeds, rms += error * error / seeds;
      said += (view.variance + light.variance) / (9 * right * right * seeds);
    }
    rms = std::sqrt(rms), said = std::sqrt(said);
  }
};

/// A bright rectangle in a black room, as the solution has it.
Deviations bright_thing(const Vec3& corner, const Vec3& u, const Vec3& v) {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {-3, -3, -0.5}, {3, 3, 3}, add_material(*scene, diffuse(0)), true);
  add_rectangle(*scene, corner, u, v, add_material(*scene, diffuse(0.8)));
  const Polygon corners = scene->surfaces.back().corners;
  const auto lit = std::make_shared<LitScene>(uniform_solution(scene, 0.5, 1000, 0));
  return Deviations(lit, 800 * form_factor({0, 0, 0}, {0, 0, 1}, corners));
}

}  // namespace

TEST_CASE("final_gather: a slit of 2 cm and a spot of 20 cm are found, and neither too often nor too seldom") {
  const Deviations slit = bright_thing({1.5, -1, 0.2}, {0, 0, 2}, {0, 0.02, 0});
  const Deviations lying = bright_thing({-1, 0.7, 2.4}, {0, 0.02, 0}, {2, 0.3, 0});
  const Deviations spot = bright_thing({0.6, -0.4, 2.4}, {0, 0.2, 0}, {0.2, 0, 0});
  for (const Deviations& one : {slit, lying, spot}) {
    CAPTURE(one.rms);
    CAPTURE(one.said);
    CHECK(one.rms < 0.25);  // 128 cosine-distributed rays: 2
    CHECK(std::abs(one.mean) < 3 * one.rms / 8);  // 64 seeds
    CHECK(one.rms < 1.5 * one.said);
  }
}

TEST_CASE("final_gather: a sky behind a window counts by what is seen of it") {
  // Sky of 4 km, 50 m above a roof with a hole of 1 m²: light as from the hole.
  for (const double distance : {2.5, 50.0}) {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t black = add_material(*scene, diffuse(0)), sky = add_material(*scene, luminous(5));
    const auto roof = [&](double x, double y, double width, double depth) {
      add_rectangle(*scene, {x, y, 2}, {0, depth, 0}, {width, 0, 0}, black);
    };
    roof(-2000, -2000, 2000.3, 4000), roof(1.3, -2000, 1998.7, 4000);
    roof(0.3, -2000, 1, 1999.5), roof(0.3, 0.5, 1, 1999.5);
    add_rectangle(*scene, {-2000, 2000, distance}, {4000, 0, 0}, {0, -4000, 0}, sky);
    const Polygon hole{{0.3, 0.5, 2}, {1.3, 0.5, 2}, {1.3, -0.5, 2}, {0.3, -0.5, 2}};
    const double right = 5 * std::numbers::pi * form_factor({0, 0, 0}, {0, 0, 1}, hole);
    const Deviations through(std::make_shared<LitScene>(uniform_solution(scene, 100, 0, 0)), right);
    CAPTURE(through.rms);
    CAPTURE(through.said);
    CHECK(through.rms < 0.04);
    CHECK(std::abs(through.mean) < 3 * through.rms / 8);
    CHECK(through.rms < 1.5 * through.said);
  }
}

TEST_CASE("final_gather: without a solution paths tell what surfaces reflect") {
  const PanelRoom room(0.5);
  const auto lit = std::make_shared<LitScene>(room.scene);
  std::uint64_t rays = 0;
  const Vec3 point{1, 1, 0.8}, up{0, 0, 1};
  const Estimate right = PathTracer(lit).irradiance({point, up}, 1 << 17, 1, rays);
  const DirectView view = lit->direct().view(point, up, {}, rays);
  const GatheredLight light = FinalGather(lit, 1 << 15).light(point, up, view, 1, rays);
  CHECK(sum_channels(view.light + light.direct + light.indirect) / sum_channels(right.mean) ==
        doctest::Approx(1).epsilon(0.01));
}
