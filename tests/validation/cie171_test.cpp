/// CIE 171:2006, the cases that need diffuse surfaces and lamps with an area; a lamp of a few centimetres stands for a point.
/// Whole runs: first pass, second pass. Here a radiance of 1 counts as 1 cd/m², so that irradiances carry the report's lux.
/// 5.2 and 5.3 are tested beside what computes direct light, too (tests/core/tracing/direct_light_test.cpp).
#include "tests/stability/whole_runs.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double most_error = 0.005;  // what the project promises at every point
/// m; patches of 0.25 lose 0.6 % of the light at reflectance .95, and the loss falls with their square (docs/stability.md).
constexpr double mesh_for_reflections = 0.125;

double relative_error(double found, double wanted) { return std::abs(found / wanted - 1); }

/// A ball of radius r made of triangles, fronts outwards: nearly the same intensity in every direction.
void add_ball(Scene& scene, const Vec3& centre, double r, std::uint32_t material) {
  constexpr int parts = 6;
  const auto point = [&](Vec3 p) { return centre + r * glm::normalize(p); };
  for (const double sx : {-1.0, 1.0})
    for (const double sy : {-1.0, 1.0})
      for (const double sz : {-1.0, 1.0}) {
        const auto at = [&](int i, int k) { return point({sx * i, sy * k, sz * (parts - i - k)}); };
        const auto triangle = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
          sx* sy* sz > 0 ? add_polygon(scene, {a, b, c}, material) : add_polygon(scene, {a, c, b}, material);
        };
        for (int i = 0; i < parts; ++i)
          for (int k = 0; i + k < parts; ++k) {
            triangle(at(i, k), at(i + 1, k), at(i, k + 1));
            if (i + k + 2 <= parts) triangle(at(i + 1, k), at(i + 1, k + 1), at(i, k + 1));
          }
      }
}

/// A closed cube of side 4 m with a ball of `flux` in its middle.
std::shared_ptr<const Scene> cube_with_a_ball(double reflectance, double flux) {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, Vec3{-2.0}, Vec3{2.0}, add_material(*scene, diffuse(reflectance)), true);
  const std::uint32_t lamp = add_material(*scene, luminous(1, reflectance));  // black it would take .2 % of all light
  add_ball(*scene, Vec3{0.0}, 0.03, lamp);
  double area = 0;
  for (const Surface& surface : scene->surfaces)
    if (surface.material == lamp) area += surface.area;
  scene->materials[lamp].radiance = Rgb{flux / (std::numbers::pi * area)};
  return scene;
}

Wanted fine(double patch_size, double eps = 1e-5) {
  Wanted wanted;
  wanted.patch_size = patch_size;
  wanted.eps = eps;
  return wanted;
}

}  // namespace

TEST_SUITE("validation") {
  TEST_CASE("CIE 171 5.3: a ceiling panel in a black room, every point within .5 %") {
    const Solution solution = solved(PanelRoom().scene, fine(0.5));
    const double walls[] = {32.68, 75.19, 81.32, 69.06, 53.40, 40.00}, floor[] = {61.42, 79.26, 95.67, 105.78};
    std::vector<SensorPoint> points;
    std::vector<double> wanted;
    for (int k = 0; k < 6; ++k) points.push_back({{2, 0, 2.75 - 0.5 * k}, {0, 1, 0}}), wanted.push_back(walls[k]);
    for (int k = 0; k < 8; ++k)
      points.push_back({{2, 0.25 + 0.5 * k, 0}, {0, 0, 1}}), wanted.push_back(floor[k < 4 ? k : 7 - k]);
    const std::vector<Rgb> light = light_at(solution, points);
    for (std::size_t i = 0; i < points.size(); ++i) CHECK(relative_error(light[i].x, wanted[i]) < most_error);
  }

  TEST_CASE("CIE 171 5.4: a closed black room receives all that is emitted") {
    const Solution solution = solved(cube_with_a_ball(0, 10000), fine(0.25));
    MESSAGE("received over emitted: " << solution.energy.absorbed / solution.energy.emitted);
    CHECK(relative_error(solution.energy.absorbed, solution.energy.emitted) < most_error);
  }

  TEST_CASE("CIE 171 5.6, scenario 2: from a floor that shines evenly, to wall and ceiling") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t black = add_material(*scene, diffuse(0));
    add_rectangle(*scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, add_material(*scene, luminous(100 / std::numbers::pi)));
    add_rectangle(*scene, {0, 0, 0.5}, {0, 0, 2.5}, {4, 0, 0}, black);
    add_rectangle(*scene, {0, 0, 3}, {0, 4, 0}, {4, 0, 0}, black);
    const double wall[] = {35.901, 27.992, 21.639, 16.716, 12.967}, ceiling[] = {26.80, 30.94, 33.98, 35.57};
    std::vector<SensorPoint> points;
    std::vector<double> wanted;
    for (int k = 0; k < 5; ++k) points.push_back({{2, 0, 0.75 + 0.5 * k}, {0, 1, 0}}), wanted.push_back(wall[k]);
    for (int k = 0; k < 4; ++k) points.push_back({{2, 0.25 + 0.5 * k, 3}, {0, 0, -1}}), wanted.push_back(ceiling[k]);
    const Solution solution = solved(scene, fine(0.5));
    const std::vector<Rgb> light = light_at(solution, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      CAPTURE(i);
      CHECK(relative_error(light[i].x, wanted[i]) < most_error);
    }
  }

  // 5.8 asks for the average over the walls at 10 000 lm; the quadrature (2e-4) for indirect light at points, in units I/h² with
  // h half the side. Both are linear in the flux, so one solution answers both.
  TEST_CASE("CIE 171 5.8: indirect light in a cube of one reflectance, average and at six points within .5 %") {
    const std::pair<double, double> averages[] = {{0.1, 11.57},  {0.3, 44.64},  {0.5, 104.17},  {0.7, 243.06},
                                                  {0.8, 416.67}, {0.9, 937.50}, {0.95, 1979.17}};
    const Vec2 places[] = {{0, 0}, {0.4, 0}, {0.8, 0}, {0.4, 0.4}, {0.8, 0.4}, {0.8, 0.8}};
    const double half[] = {0.5632, 0.5596, 0.5397, 0.5520, 0.5220, 0.4686};
    const double high[] = {10.041, 10.034, 9.994, 10.017, 9.951, 9.812};
    const double h = 2, flux = 10000, unit = flux / (4 * std::numbers::pi * h * h);
    std::vector<SensorPoint> points;
    for (const Vec2& at : places) points.push_back({{h * at.x, h * at.y, -h}, {0, 0, 1}});
    for (const auto& [reflectance, average] : averages) {
      CAPTURE(reflectance);
      const double* at_points = reflectance == 0.5 ? half : reflectance == 0.95 ? high : nullptr;
      if (at_points == nullptr && !long_trials()) continue;
      const Solution solution = solved(cube_with_a_ball(reflectance, flux), fine(mesh_for_reflections, 1e-4));
      double sum = 0, area = 0;  // of the walls alone
      for (const Patch& patch : solution.mesh->patches) {
        if (patch.surface.value >= 6 || patch.back) continue;
        for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
          sum += solution.mesh->elements[e].area * solution.indirect(e).x, area += solution.mesh->elements[e].area;
      }
      MESSAGE("reflectance " << reflectance << ": " << sum / area << ", wanted " << average);
      CHECK(area == doctest::Approx(96));
      CHECK(relative_error(sum / area, average) < most_error);
      if (at_points == nullptr) continue;
      ProbeOptions options;
      options.gather_rays = 4096;  // their noise is not in question here
      std::uint64_t rays = 0;
      const std::vector<PointLight> light =
          sensor_light(std::make_shared<LitScene>(solution), points, options, Parallel(1), rays);
      for (std::size_t i = 0; i < points.size(); ++i) {
        MESSAGE("point " << i << ": " << light[i].indirect.x / unit << ", wanted " << at_points[i]);
        CHECK(relative_error(light[i].indirect.x / unit, at_points[i]) < most_error);
      }
    }
  }
}
