/// Lamps of every size and number, against closed forms.
#include "core/light/form_factor.hpp"
#include "tests/stability/whole_runs.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// Irradiance straight from a polygon of radiance L that nothing hides (W/m²).
double direct_from(const Polygon& lamp, double radiance, const SensorPoint& at) {
  return std::numbers::pi * radiance * form_factor(at.point, at.normal, lamp);
}

double worst_direct(const Solution& solution, const Polygon& lamp, double radiance) {
  double worst = 0;
  for (const Patch& patch : solution.mesh->patches) {
    const Plane& plane = solution.mesh->planes[patch.plane.value];
    if (patch.back || !solution.mesh->group_is_lit[patch.group.value]) continue;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const double exact = direct_from(lamp, radiance, {plane.point(solution.mesh->elements[e].centre), plane.normal});
      if (exact > 0) worst = std::max(worst, std::abs(solution.direct_irradiance[e].x / exact - 1));
    }
  }
  return worst;
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: a lamp of 1 cm in a hall of 20 x 20 x 10 m") {
    auto scene = std::make_shared<Scene>();
    const double reflectance = 0.5, radiance = 1e6;
    add_box(*scene, {0, 0, 0}, {20, 20, 10}, add_material(*scene, diffuse(reflectance)), true);
    add_rectangle(*scene, {8, 9, 8}, {0, 0.01, 0}, {0.01, 0, 0}, add_material(*scene, luminous(radiance, reflectance)));
    Wanted wanted;
    wanted.patch_size = 2;
    wanted.eps = 1e-5;
    const Solution solution = solved(scene, wanted);
    const double worst = worst_direct(solution, scene->surfaces.back().corners, radiance);
    const double s = 2 * 400 + 4 * 200 + 2e-4, phi = std::numbers::pi * radiance * 1e-4;
    const double exact = reflectance * phi / (s * (1 - reflectance));
    MESSAGE("worst direct light " << worst << ", mean indirect over exact " << mean_indirect(solution) / exact);
    CHECK(worst < 2e-3);  // single precision, which loses in proportion to distance over size: 1500 here, 5e-5 at 50
    CHECK(std::abs(mean_indirect(solution) / exact - 1) < 0.02);  // groups shoot their mean: docs/stability.md
  }

  TEST_CASE("stability: a luminous ceiling") {
    auto scene = std::make_shared<Scene>();
    const double reflectance = 0.5;
    const std::uint32_t wall = add_material(*scene, diffuse(reflectance)),
                        sky = add_material(*scene, luminous(100, reflectance));
    add_box(*scene, {0, 0, 0}, {10, 6, 3}, wall, true);
    scene->surfaces.back().material = sky;
    Wanted wanted;
    wanted.patch_size = 0.5;
    wanted.eps = 1e-4;
    const Solution solution = solved(scene, wanted);
    const double worst = worst_direct(solution, scene->surfaces.back().corners, 100);
    const double s = 2 * 60 + 2 * 30 + 2 * 18, phi = std::numbers::pi * 100 * 60;
    const double exact = reflectance * phi / (s * (1 - reflectance));
    MESSAGE("worst direct light " << worst << ", mean indirect over exact " << mean_indirect(solution) / exact);
    CHECK(worst < 1e-4);
    CHECK(std::abs(mean_indirect(solution) / exact - 1) < 0.005);
  }

  TEST_CASE("stability: 1024 lamps give what one of their size gives") {
    const auto room = [](int lamps_along) {
      auto scene = std::make_shared<Scene>();
      const std::uint32_t wall = add_material(*scene, diffuse(0.6)), lamp = add_material(*scene, luminous(10, 0.3));
      add_box(*scene, {0, 0, 0}, {4, 4, 3}, wall, true);
      const double edge = 2.0 / lamps_along;
      for (int i = 0; i < lamps_along; ++i)
        for (int k = 0; k < lamps_along; ++k)
          add_rectangle(*scene, {1 + i * edge, 0.5 + k * edge, 2.8}, {0, edge, 0}, {edge, 0, 0}, lamp);
      return scene;
    };
    constexpr double places[] = {0.07, 0.31, 0.52, 0.77};
    const auto light = [&](int lamps_along) {
      Wanted wanted;
      wanted.patch_size = 0.5;
      return light_at(solved(room(lamps_along), wanted), points_inside(Vec3{0.0}, {4, 4, 3}, places));
    };
    const double difference = rms_difference(light(32), light(1));
    MESSAGE("difference " << difference);
    CHECK(difference < 0.005);
  }
}
