#include "core/tracing/error_check.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "core/tracing/path_tracer.hpp"
#include "core/tracing/probe.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// A coloured room with a box in it, solved coarsely.
struct CheckedRoom {
  std::shared_ptr<const LitScene> scene;
  explicit CheckedRoom(Finish finish = Finish::diffuse) {
    PanelRoom room(0.6);
    const std::uint32_t box = finish == Finish::diffuse ? add_material(*room.scene, diffuse(0.3))
                                                        : add_material(*room.scene, specular(finish, 0.6, 0.2, 20));
    add_box(*room.scene, {0.8, 0.9, 0}, {1.9, 1.7, 1.4}, box, false);
    OneCell cell(room.scene, mesh_with(*room.scene, 0.8));
    cell.solve(2e-3);
    scene = std::make_shared<LitScene>(cell.solution());
  }
};

/// Inside: without lit sides known, the backs of a box count as well.
std::vector<CheckPoint> points_inside(const LitScene& scene, std::uint32_t count, std::uint64_t seed) {
  std::vector<CheckPoint> points = random_surface_points(scene, 2 * count, seed);
  std::erase_if(points, [](const CheckPoint& point) { return point.at.back; });
  return points;
}

std::vector<PointLight> read(const CheckedRoom& room, const std::vector<CheckPoint>& points) {
  std::vector<SensorPoint> sensors;
  for (const CheckPoint& point : points) sensors.push_back({point.at.point, point.at.normal});
  ProbeOptions options;
  options.indirect = IndirectMethod::interpolate;
  std::uint64_t rays = 0;
  return sensor_light(room.scene, sensors, options, Parallel(1), rays);
}

/// The relative RMS error by path tracing, its own noise taken out.
double error_by_paths(const CheckedRoom& room, const std::vector<CheckPoint>& points,
                      const std::vector<PointLight>& given, std::uint32_t paths) {
  std::vector<SensorPoint> sensors;
  for (const CheckPoint& point : points) sensors.push_back({point.at.point, point.at.normal});
  std::uint64_t rays = 0;
  const auto truth = reference_irradiance(PathTracer(room.scene), sensors, paths, Parallel(2), rays);
  double squares = 0, whole = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Rgb e = given[i].total() - truth[i].mean, se = truth[i].standard_error;
    squares += points[i].weight * (glm::dot(e, e) - glm::dot(se, se));
    whole += points[i].weight * (glm::dot(truth[i].mean, truth[i].mean) - glm::dot(se, se));
  }
  return std::sqrt(std::max(squares, 0.0) / whole);
}

}  // namespace

TEST_CASE("error_check: what is right is found right, and an error that is put in is found") {
  const Furnace furnace(1, 0.8);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  const std::vector<CheckPoint> points = points_inside(*scene, 64, 3);
  const auto checked = [&](double factor) {
    const Rgb direct{furnace.direct()}, indirect{factor * furnace.total() - furnace.direct()};
    return check_error(scene, points, std::vector<PointLight>(points.size(), {direct, indirect}), {}, Parallel(2));
  };
  // Each batch of an even field is exact: only the walks' ends are drawn, and their residual is 0.
  CHECK(checked(1.0).error < 1e-4);
  CHECK(checked(1.05).error == doctest::Approx(0.05).epsilon(1e-3));
  CHECK(checked(0.97).bias == doctest::Approx(-0.03).epsilon(1e-3));
  CHECK(checked(1.05).visibility < 1e-4);
}

TEST_CASE("error_check: an error of the solution is found although all that is read agrees with it") {
  // A furnace that is solved too bright by 5 %: a gather of it brings rho times the same error, and the walks the rest.
  const Furnace furnace(1, 0.8);
  const auto scene =
      std::make_shared<LitScene>(uniform_solution(furnace.scene, 0.1, 1.05 * furnace.total(), furnace.direct()));
  const std::vector<CheckPoint> points = points_inside(*scene, 64, 4);
  const Rgb direct{furnace.direct()}, seen{1.05 * 0.8 * furnace.total()};
  ErrorCheckOptions options;
  options.walks = 8;
  const ErrorEstimate found =
      check_error(scene, points, std::vector<PointLight>(points.size(), {direct, seen}), options, Parallel(2));
  CHECK(found.error == doctest::Approx(0.04).epsilon(0.2));
  CHECK(found.bias == doctest::Approx(0.04).epsilon(0.1));
  CHECK(found.solution == doctest::Approx(0.04).epsilon(0.2));
}

TEST_CASE("error_check: says what path tracing says, of interpolated light in a furnished room") {
  for (const Finish finish : {Finish::diffuse, Finish::mirror, Finish::glossy, Finish::glass}) {
    const CheckedRoom room(finish);
    const std::vector<CheckPoint> points = random_surface_points(*room.scene, 200, 5);
    const std::vector<PointLight> given = read(room, points);
    const ErrorEstimate found = check_error(room.scene, points, given, {}, Parallel(2));
    // The same points: what differs is the noise of both, 0.6 of the error at most here, so a tenth of it in the mean.
    const double expected = error_by_paths(room, points, given, 4000);
    CAPTURE(int(finish));
    CAPTURE(found.noise);
    CHECK(found.error == doctest::Approx(expected).epsilon(0.25));
    CHECK(found.low <= found.error);
    CHECK(found.high >= found.error);
  }
}

TEST_CASE("error_check: the answer does not depend on the threads") {
  const CheckedRoom room;
  const std::vector<CheckPoint> points = random_surface_points(*room.scene, 50, 6);
  const std::vector<PointLight> given = read(room, points);
  const ErrorEstimate one = check_error(room.scene, points, given, {}, Parallel(1)),
                      two = check_error(room.scene, points, given, {}, Parallel(2));
  CHECK(one.error == two.error);
  CHECK(one.rays == two.rays);
}

TEST_CASE("error_check: points lie on lit sides, weigh as much as their area, and are most where the light is") {
  const CheckedRoom room;
  constexpr double wanted = 4000;
  const std::vector<CheckPoint> points = random_surface_points(*room.scene, 4000, 7);
  REQUIRE(points.size() == 4000);
  const Scene& scene = room.scene->trace().scene();
  double lit_m2 = 0, irradiance = 0;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s)
    lit_m2 += scene.surfaces[s].area *
              (int{room.scene->mesh().lit_sides[s].front} + int{room.scene->mesh().lit_sides[s].back});
  std::vector<double> weight(scene.surfaces.size(), 0.0);
  for (const CheckPoint& point : points) {
    weight[point.at.surface] += point.weight;
    CHECK(room.scene->has_elements(point.at));
    CHECK(point.weight > 0);
    CHECK(point.weight <= 2);
    irradiance += point.weight * sum_channels(room.scene->total_irradiance(point.at)) / wanted;
  }
  // Stratified along the list of patches: each has its share to one point.
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const LitSides lit = room.scene->mesh().lit_sides[s];
    const double expected = wanted * scene.surfaces[s].area * (int{lit.front} + int{lit.back}) / lit_m2;
    CHECK(weight[s] == doctest::Approx(expected).epsilon(0.02));
  }
  double bright = 0, dim = 0, bright_points = 0;
  for (const CheckPoint& point : points) {
    const bool is_bright = sum_channels(room.scene->total_irradiance(point.at)) > irradiance;
    (is_bright ? bright : dim) += point.weight, bright_points += is_bright;
  }
  CHECK(bright / bright_points < 0.9 * dim / (wanted - bright_points));
}

TEST_CASE("error_check: where the light is even, each side has as many points as its area, to two") {
  const CheckedRoom room;
  const auto scene = room.scene->trace().shared_scene();
  const LitScene even(uniform_solution(scene, 0.2, 2, 1));
  const std::vector<CheckPoint> points = random_surface_points(even, 4000, 7);
  double lit_m2 = 0;
  for (const Patch& patch : even.mesh().patches)
    if (even.mesh().group_is_lit[patch.group.value]) lit_m2 += patch.area;
  std::map<std::pair<std::uint32_t, bool>, double> expected, count;
  for (const Patch& patch : even.mesh().patches)
    if (even.mesh().group_is_lit[patch.group.value])
      expected[{patch.surface.value, patch.back}] += 4000 * patch.area / lit_m2;
  for (const CheckPoint& point : points) {
    CHECK(point.weight == doctest::Approx(1));
    ++count[{point.at.surface, point.at.back}];
  }
  for (const auto& [side, wanted] : expected) CHECK(std::abs(count[side] - wanted) <= 2);
}
