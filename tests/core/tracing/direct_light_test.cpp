#include "core/tracing/direct_light.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/light/form_factor.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {
double light(const DirectLight& direct, const Vec3& point, const Vec3& normal, std::uint32_t rays = 256) {
  std::uint64_t count = 0;
  return direct.irradiance(point, normal, {rays, 64, {}}, count).x;
}
}  // namespace

TEST_CASE("direct_light: CIE 171 5.3, a ceiling panel in a black room") {
  const PanelRoom room;
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  // Wall points A-F at x = 2 on the wall y = 0, printed with two decimals.
  const double wall[] = {32.68, 75.19, 81.32, 69.06, 53.40, 40.00};
  for (int i = 0; i < 6; ++i)
    CHECK(light(direct, {2, 0, 2.75 - 0.5 * i}, {0, 1, 0}) == doctest::Approx(wall[i]).epsilon(2e-4));
  const double floor[] = {61.42, 79.26, 95.67, 105.78, 105.78, 95.67, 79.26, 61.42};
  for (int i = 0; i < 8; ++i)
    CHECK(light(direct, {2, 0.25 + 0.5 * i, 0}, {0, 0, 1}) == doctest::Approx(floor[i]).epsilon(2e-4));
}

TEST_CASE("direct_light: CIE 171 5.2, a panel so small that it is a Lambertian point of 1000 cd") {
  auto scene = std::make_shared<Scene>();
  const double side = 0.01;
  add_box(*scene, {-2, -2, 0}, {2, 2, 3.5}, add_material(*scene, diffuse(0)), true);
  add_rectangle(*scene, {-side / 2, side / 2, 3}, {side, 0, 0}, {0, -side, 0},
                add_material(*scene, luminous(1000 / (side * side))));
  const DirectLight direct(std::make_shared<TraceScene>(scene));
  const double table[][3] = {{0, 0, 111.11}, {.5, 0, 105.19},  {1, 0, 90.00}, {1.5, 0, 71.11}, {.5, .5, 99.72},
                             {1, .5, 85.66}, {1.5, .5, 68.05}, {1, 1, 74.38}, {1.5, 1, 59.98}, {1.5, 1.5, 49.38}};
  for (const auto& [x, y, lux] : table)
    CHECK(light(direct, {x, y, 0}, {0, 0, 1}) == doctest::Approx(lux).epsilon(1e-4));
}

TEST_CASE("direct_light: a luminaire shines to its front only, and not on itself") {
  const PanelRoom room;
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  CHECK(light(direct, {2, 2, 3.5}, {0, 0, -1}) == 0.0);
  CHECK(light(direct, {2, 2, 3}, {0, 0, -1}) == 0.0);
  CHECK(light(direct, {2, 2, 1}, {0, 0, -1}) == 0.0);
}

TEST_CASE("direct_light: a screen over half of the panel leaves the other half's light") {
  PanelRoom room;
  // Directly under the panel, covering x < 2.
  add_rectangle(*room.scene, {1, 1, 2.999}, {1, 0, 0}, {0, 2, 0}, 0);
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  const Polygon half{{2, 1.5, 3}, {2, 2.5, 3}, {2.5, 2.5, 3}, {2.5, 1.5, 3}};
  for (const double x : {0.3, 2.0, 3.6}) {
    const double expected = 1000 * std::numbers::pi * form_factor({x, 2, 0}, {0, 0, 1}, half);
    CHECK(light(direct, {x, 2, 0}, {0, 0, 1}) == doctest::Approx(expected).epsilon(0.01));
  }
}

TEST_CASE("direct_light: jittered rays converge to the same light as a fine grid") {
  PanelRoom room;
  add_box(*room.scene, {1.3, 1.6, 1}, {2.1, 2.2, 1.2}, 0, false);
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  const Vec3 point{2.45, 2.3, 0}, up{0, 0, 1};
  std::uint64_t rays = 0;
  double sum = 0;
  const int samples = 400;
  for (int s = 0; s < samples; ++s) sum += direct.irradiance(point, up, {16, 4, static_cast<std::uint64_t>(s)}, rays).x;
  const double open = 1000 * std::numbers::pi * form_factor(point, up, room.scene->surfaces[9].corners);
  const double fine = light(direct, point, up);
  CHECK(rays == 4u * samples);
  CHECK(fine < 0.95 * open);
  CHECK(fine > 0.05 * open);
  CHECK(sum / samples == doctest::Approx(fine).epsilon(0.03));
}

TEST_CASE("direct_light: hundreds of luminaires cost few rays and lose nothing") {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {40, 40, 4}, add_material(*scene, diffuse(0)), true);
  const std::uint32_t lamp = add_material(*scene, luminous(50));
  double expected = 0;
  const Vec3 point{13.3, 17.1, 0}, up{0, 0, 1};
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) {
      const Vec3 corner{2.0 * i + 0.7, 2.0 * j + 1.3, 3.9};
      add_rectangle(*scene, corner, {0.6, 0, 0}, {0, -0.6, 0}, lamp);
      expected += 50 * std::numbers::pi * form_factor(point, up, scene->surfaces.back().corners);
    }
  const DirectLight direct(std::make_shared<TraceScene>(scene));
  REQUIRE(direct.luminaire_count() == 400);
  std::uint64_t rays = 0;
  CHECK(direct.irradiance(point, up, {256, 64, {}}, rays).x == doctest::Approx(expected).epsilon(1e-3));
  CHECK(rays < 1000);
  CHECK(rays >= 100);
}

TEST_CASE("direct_light: a lamp of a thousand facets gets some hundred rays, and its shadow is right on average") {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t lamp = add_material(*scene, luminous(50)), grey = add_material(*scene, diffuse(0));
  constexpr int n = 32;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      add_rectangle(*scene, {1.0 * i / n, 1.0 * j / n, 3}, {0, 1.0 / n, 0}, {1.0 / n, 0, 0}, lamp);
  const Vec3 point{0.5, 0.5, 0}, up{0, 0, 1};
  const Vec3 half[] = {{0, 0, 3}, {0, 1, 3}, {0.5, 1, 3}, {0.5, 0, 3}};
  const double whole = 2 * 50 * std::numbers::pi * form_factor(point, up, half);
  std::uint64_t rays = 0;
  CHECK(DirectLight(std::make_shared<TraceScene>(scene)).irradiance(point, up, {256, 64, {}}, rays).x ==
        doctest::Approx(whole).epsilon(1e-3));
  CHECK(rays >= 128);
  CHECK(rays <= 400);
  add_rectangle(*scene, {-1, -1, 1.5}, {1.5, 0, 0}, {0, 4, 0}, grey);  // hides the half with x < .5
  CHECK(DirectLight(std::make_shared<TraceScene>(scene)).irradiance(point, up, {256, 64, {}}, rays).x ==
        doctest::Approx(whole / 2).epsilon(0.05));
}

TEST_CASE("direct_light: light passes a clear pane, less what it reflects") {
  PanelRoom room;
  add_rectangle(*room.scene, {0, 0, 1.5}, {4, 0, 0}, {0, 4, 0}, add_material(*room.scene, glass(1.52)));
  const PanelRoom open;
  const DirectLight with(std::make_shared<TraceScene>(room.scene)), without(std::make_shared<TraceScene>(open.scene));
  CHECK(light(with, {2, 2, 0}, {0, 0, 1}) / light(without, {2, 2, 0}, {0, 0, 1}) ==
        doctest::Approx(0.918).epsilon(1e-3));
}

TEST_CASE("direct_light: points drawn on luminaires have the density that is stated") {
  auto scene = std::make_shared<Scene>();
  add_rectangle(*scene, {0, 0, 0}, {1, 0, 0}, {0, 2, 0}, add_material(*scene, luminous(3)));
  add_polygon(*scene, {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}}, add_material(*scene, luminous(8)));
  const DirectLight direct(std::make_shared<TraceScene>(scene));
  Random random(1);
  int second = 0;
  Vec3 mean{0.0};
  const int count = 20000;
  for (int i = 0; i < count; ++i) {
    const DirectLight::Sample sample = direct.sample(random);
    const bool of_second = sample.point.x > 3;
    second += of_second;
    if (of_second) mean += sample.point;
    CHECK(sample.density == doctest::Approx(direct.density(of_second)));
  }
  // Powers are 6 : 4; the second triangle has its centre of gravity at a third.
  CHECK(second / double(count) == doctest::Approx(0.4).epsilon(0.03));
  CHECK(mean.x / second == doctest::Approx(5 + 1 / 3.0).epsilon(0.005));
  CHECK(direct.density(0) * 2 + direct.density(1) * 0.5 == doctest::Approx(1));
}

TEST_CASE("direct_light: one shadow ray tells the light of many luminaires without bias, near and far") {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t lamp = add_material(*scene, luminous(100)), grey = add_material(*scene, diffuse(0));
  for (const double x : {-4.0, -1.0, 0.5, 3.0}) add_rectangle(*scene, {x, 0.2, 2}, {0.6, 0, 0}, {0, -0.4, 0}, lamp);
  add_rectangle(*scene, {-0.1, -0.1, 0.3}, {0.2, 0, 0}, {0, -0.2, 0}, lamp);
  add_rectangle(*scene, {-2, -2, 1}, {1.5, 0, 0}, {0, 4, 0}, grey);  // hides some
  const DirectLight direct(std::make_shared<TraceScene>(scene));
  const double right = light(direct, {0, 0, 0}, {0, 0, 1}, 4096);
  Random random(5);
  std::uint64_t rays = 0;
  double sum = 0;
  constexpr int count = 1 << 16;
  for (int i = 0; i < count; ++i) sum += direct.one_ray_irradiance({0, 0, 0}, {0, 0, 1}, random, rays).x;
  CHECK(sum / count == doctest::Approx(right).epsilon(0.01));
}

TEST_CASE("direct_light: what nothing hides is exact in a view, and shared with nobody") {
  const PanelRoom room;
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  std::uint64_t rays = 0;
  const DirectView view = direct.view({2, 1.75, 0}, {0, 0, 1}, {}, rays);
  CHECK(view.light.x == doctest::Approx(105.78).epsilon(1e-4));
  CHECK(view.variance == 0);
  CHECK(view.samples.empty());
  CHECK(!view.density(static_cast<std::uint32_t>(room.scene->surfaces.size() - 1)));
}
