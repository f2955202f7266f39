#include "core/tracing/path_tracer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/light/form_factor.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// One miss in 16 000 by chance; all seeds are fixed.
constexpr double standard_errors = 4;
/// Single-precision rays lose a few paths at edges.
constexpr double ray_noise = 2e-4;

void check_near(const Estimate& estimate, double expected) {
  CAPTURE(estimate.mean.x);
  CAPTURE(estimate.standard_error.x);
  CAPTURE(expected);
  CHECK(std::abs(estimate.mean.x - expected) <= standard_errors * estimate.standard_error.x + ray_noise * expected);
}

}  // namespace

TEST_CASE("path_tracer: CIE 171 5.3 within four standard errors") {
  const PanelRoom room;
  const PathTracer tracer(std::make_shared<LitScene>(room.scene));
  std::uint64_t rays = 0;
  check_near(tracer.irradiance({{2, 0, 2.25}, {0, 1, 0}}, 4000, 1, rays), 75.19);
  check_near(tracer.irradiance({{2, 0.25, 0}, {0, 0, 1}}, 4000, 2, rays), 61.42);
  check_near(tracer.irradiance({{2, 1.75, 0}, {0, 0, 1}}, 4000, 3, rays), 105.78);
}

TEST_CASE("path_tracer: the furnace, where luminaires are hit by chance as often as by shadow rays") {
  for (const double reflectance : {0.5, 0.9}) {
    const Furnace furnace(1, reflectance);
    const PathTracer tracer(std::make_shared<LitScene>(furnace.scene));
    std::uint64_t rays = 0;
    check_near(tracer.irradiance({{0.5, 0.5, 0}, {0, 0, 1}}, 4000, 1, rays), furnace.total());
    check_near(tracer.irradiance({{0.3, 0.6, 0.5}, {1, 0, 1}}, 4000, 2, rays), furnace.total());
  }
}

TEST_CASE("path_tracer: indirect light of a closed room of uniform reflectance has the mean ρΦ/((1-ρ)S)") {
  // Cube with one luminous face; average over the six faces of the total irradiance is Φ/((1-ρ)S).
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = add_material(*scene, diffuse(0.7)), lamp = add_material(*scene, luminous(1, 0.7));
  add_box(*scene, {0, 0, 0}, {1, 1, 1}, wall, true);
  scene->surfaces[5].material = lamp;
  const PathTracer tracer(std::make_shared<LitScene>(scene));
  const Vec3 normals[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  Random random(1);
  Estimate sum;
  std::uint64_t rays = 0;
  const int points = 1200;
  double first = 0, second = 0;
  for (int i = 0; i < points; ++i) {
    const Vec3 n = normals[i % 6];
    const double a = random.unit(), b = random.unit();
    const int axis = (i % 6) / 2;
    Vec3 p;
    p[axis] = n[axis] > 0 ? 0 : 1, p[(axis + 1) % 3] = a, p[(axis + 2) % 3] = b;
    const double value = tracer.irradiance({p, n}, 16, static_cast<std::uint64_t>(i), rays).mean.x;
    first += value, second += value * value;
  }
  sum.mean = Rgb{first / points};
  sum.standard_error = Rgb{std::sqrt((second / points - sum.mean.x * sum.mean.x) / points)};
  check_near(sum, std::numbers::pi / (6 * 0.3));
}

TEST_CASE("path_tracer: in a white furnace mirrors, gloss and glass are invisible") {
  // Walls that emit 1 and reflect nothing: a body that absorbs nothing is as bright as the walls behind it.
  const auto body = [](const Material& material, bool is_pane) {
    auto scene = std::make_shared<Scene>();
    add_box(*scene, {0, 0, 0}, {4, 4, 4}, add_material(*scene, luminous(1)), true);
    const std::uint32_t m = add_material(*scene, material);
    if (is_pane)
      add_rectangle(*scene, {1, 2, 1}, {2, 0.3, 0}, {0, 0.2, 2}, m);
    else
      add_box(*scene, {1.2, 1.7, 1.3}, {2.6, 2.9, 2.8}, m, false);
    return scene;
  };
  Material white_gloss = specular(Finish::glossy, 0.5, 0.5, 5);
  const std::pair<Material, bool> bodies[] = {{specular(Finish::mirror, 1.0), false},
                                              {specular(Finish::mirror, 0.4, 0.6), false},
                                              {glass(1.5), false},
                                              {glass(1.5), true},
                                              {diffuse(0.999999), false}};
  const PinholeCamera camera({"", {0.5, 0.4, 2.3}, {2, 2.5, 2}, {0, 0, 1}, 50}, 6, 6);
  for (const auto& [material, is_pane] : bodies) {
    const auto finish = static_cast<int>(material.finish);
    CAPTURE(finish);
    const PathTracer tracer(std::make_shared<LitScene>(body(material, is_pane)));
    std::uint64_t rays = 0;
    for (std::uint32_t i = 0; i < 36; ++i) check_near(tracer.pixel(camera, i % 6, i / 6, 400, rays), 1.0);
  }
  // The Phong lobe loses what it would throw below the horizon, and never gains.
  const PathTracer tracer(std::make_shared<LitScene>(body(white_gloss, false)));
  std::uint64_t rays = 0;
  for (std::uint32_t i = 0; i < 36; ++i) {
    const Estimate pixel = tracer.pixel(camera, i % 6, i / 6, 400, rays);
    CHECK(pixel.mean.x <= 1 + standard_errors * pixel.standard_error.x + ray_noise);
    CHECK(pixel.mean.x > 0.6);
  }
}

TEST_CASE("path_tracer: a pane before a panel dims it by its reflectance") {
  PanelRoom room;
  add_rectangle(*room.scene, {0, 0, 1.5}, {4, 0, 0}, {0, 4, 0}, add_material(*room.scene, glass(1.52)));
  const PathTracer tracer(std::make_shared<LitScene>(room.scene));
  const DirectLight direct(std::make_shared<TraceScene>(room.scene));
  std::uint64_t rays = 0;
  for (const double x : {2.0, 0.3}) {
    const double expected = direct.irradiance({x, 2, 0}, {0, 0, 1}, {256, 64, {}}, rays).x;
    check_near(tracer.irradiance({{x, 2, 0}, {0, 0, 1}}, 8000, 5, rays), expected);
  }
}

TEST_CASE("path_tracer: the same seed gives the same bits, columns are independent of the partition") {
  const PanelRoom room(0.5);
  const auto scene = std::make_shared<LitScene>(room.scene);
  const PinholeCamera camera({"", {2, 0.5, 1.5}, {2, 3, 1.2}, {0, 0, 1}, 60}, 8, 6);
  const ReferenceTracer one(scene, camera, 3, std::make_shared<Parallel>(1)),
      two(scene, camera, 3, std::make_shared<Parallel>(2));
  std::uint64_t rays = 0;
  const std::vector<Rgbf> whole = one.columns({0, 8}, rays), last = two.columns({5, 8}, rays);
  CHECK(std::equal(last.begin(), last.end(), whole.begin() + 5 * 6));
}
