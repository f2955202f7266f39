#include "core/tracing/check_points.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {
std::shared_ptr<const LitScene> lit(double total, double direct) {
  return std::make_shared<LitScene>(uniform_solution(PanelRoom(0.6).scene, 0.4, total, direct));
}
}  // namespace

TEST_CASE("check_points: each lit side has as many points as its area, to two") {
  const auto scene = lit(2, 1);
  const CheckPoints places = surface_check_points(*scene, 4000, 7);
  REQUIRE(places.points.size() == 4000);
  CHECK(places.norm == ErrorNorm::of_each);
  CHECK_FALSE(places.is_all);
  double lit_m2 = 0;
  for (const Patch& patch : scene->mesh().patches)
    if (scene->mesh().group_is_lit[patch.group.value]) lit_m2 += patch.area;
  std::map<std::pair<std::uint32_t, bool>, double> expected, count;
  for (const Patch& patch : scene->mesh().patches)
    if (scene->mesh().group_is_lit[patch.group.value])
      expected[{patch.surface.value, patch.back}] += 4000 * patch.area / lit_m2;
  for (const CheckPoint& point : places.points) {
    CHECK(scene->has_elements(point.at));
    ++count[{point.at.surface, point.at.back}];
  }
  for (const auto& [side, wanted] : expected) CHECK(std::abs(count[side] - wanted) <= 2);
}

TEST_CASE("check_points: sensor points are looked at themselves, all of a few, one of each run of many") {
  const auto scene = lit(2, 1);
  std::vector<SensorPoint> sensors;
  for (int i = 0; i < 100; ++i) sensors.push_back({{1 + 0.01 * i, 1, 0.8}, {0, 0, 3}});
  const CheckPoints all = sensor_check_points(*scene, sensors, 100, 1),
                    some = sensor_check_points(*scene, sensors, 10, 1);
  CHECK(all.is_all);
  REQUIRE(all.points.size() == 100);
  for (std::size_t i = 0; i < 100; ++i) CHECK(all.points[i].at.point == sensors[i].point);
  CHECK_FALSE(some.is_all);
  REQUIRE(some.points.size() == 10);
  for (std::size_t i = 0; i < 10; ++i) {
    const double place = (some.points[i].at.point.x - 1) / 0.1;
    CHECK(place >= static_cast<double>(i) - 1e-9);
    CHECK(place < static_cast<double>(i + 1));
    CHECK(glm::length(some.points[i].at.normal) == doctest::Approx(1));
  }
  sensors[3].normal = Vec3{0.0};
  CHECK(sensor_check_points(*scene, sensors, 100, 1).points.size() == 99);
}

TEST_CASE("check_points: pixels show what surfaces without emission send, and white follows the exposure") {
  const auto scene = lit(2, 1);
  Camera view;
  view.eye = {1.5, 0.3, 1.2}, view.target = {1.5, 2, 1.4}, view.up = {0, 0, 1}, view.vertical_fov_deg = 60;
  const PinholeCamera camera(view, 64, 48);
  const CheckPoints places = picture_check_points(*scene, camera, 0, 192, 5);
  REQUIRE(places.points.size() > 100);
  const Scene& input = scene->trace().scene();
  for (const CheckPoint& point : places.points) {
    CHECK((point.at.back || !input.material_of(input.surfaces[point.at.surface]).emits()));
    CHECK(point.share.x == doctest::Approx(0.6 / std::numbers::pi));
  }
  // All is as bright as the average, whose grey is .18 where 7.24 is white.
  CHECK(places.white == doctest::Approx(7.24 / 0.18 * 0.6 * 2 / std::numbers::pi));
  CHECK(picture_check_points(*scene, camera, 4, 192, 5).white == doctest::Approx(7.24 / 4));
}
