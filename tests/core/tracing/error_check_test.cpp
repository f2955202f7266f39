#include "core/tracing/error_check.hpp"

#include <doctest/doctest.h>

#include <cmath>

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

/// Even over the area, all relative to all. Inside: without lit sides known, the backs of a box count as well.
CheckPoints points_of(const LitScene& scene, std::uint32_t count, std::uint64_t seed, bool only_inside = false) {
  CheckPoints places = surface_check_points(scene, only_inside ? 2 * count : count, seed);
  places.norm = ErrorNorm::of_all;
  if (only_inside) std::erase_if(places.points, [](const CheckPoint& point) { return point.at.back; });
  return places;
}

std::vector<SensorPoint> sensors_at(const CheckPoints& places) {
  std::vector<SensorPoint> sensors;
  for (const CheckPoint& point : places.points) sensors.push_back({point.at.point, point.at.normal});
  return sensors;
}

std::vector<PointLight> read(const CheckedRoom& room, const CheckPoints& places) {
  ProbeOptions options;
  options.indirect = IndirectMethod::interpolate;
  std::uint64_t rays = 0;
  return sensor_light(room.scene, sensors_at(places), options, Parallel(1), rays);
}

/// The relative RMS error by path tracing, its own noise taken out.
double error_by_paths(const CheckedRoom& room, const CheckPoints& places, const std::vector<PointLight>& given,
                      std::uint32_t paths) {
  std::uint64_t rays = 0;
  const auto truth = reference_irradiance(PathTracer(room.scene), sensors_at(places), paths, Parallel(2), rays);
  double squares = 0, whole = 0, mean = 0;
  for (const Estimate& at : truth) mean += glm::length(at.mean) / static_cast<double>(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Rgb e = given[i].total() - truth[i].mean, se = truth[i].standard_error;
    const double exact = glm::dot(truth[i].mean, truth[i].mean) - glm::dot(se, se);
    const double square = glm::dot(e, e) - glm::dot(se, se);
    // Under the box there is no light at all.
    const bool is_of_all = places.norm == ErrorNorm::of_all;
    squares += is_of_all ? square : square / (std::max(exact, 0.0) + 1e-4 * mean * mean), whole += is_of_all ? exact : 1;
  }
  return std::sqrt(std::max(squares, 0.0) / whole);
}

}  // namespace

TEST_CASE("error_check: what is right is found right, and an error that is put in is found") {
  const Furnace furnace(1, 0.8);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  const CheckPoints places = points_of(*scene, 64, 3, true);
  const auto checked = [&](double factor) {
    const Rgb direct{furnace.direct()}, indirect{factor * furnace.total() - furnace.direct()};
    return check_error(scene, places, std::vector<PointLight>(places.points.size(), {direct, indirect}), {},
                       Parallel(2));
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
  const CheckPoints places = points_of(*scene, 64, 4, true);
  const Rgb direct{furnace.direct()}, seen{1.05 * 0.8 * furnace.total()};
  ErrorCheckOptions options;
  options.walks = 8;
  const ErrorEstimate found =
      check_error(scene, places, std::vector<PointLight>(places.points.size(), {direct, seen}), options, Parallel(2));
  CHECK(found.error == doctest::Approx(0.04).epsilon(0.2));
  CHECK(found.bias == doctest::Approx(0.04).epsilon(0.1));
  CHECK(found.solution == doctest::Approx(0.04).epsilon(0.2));
}

TEST_CASE("error_check: says what path tracing says, of interpolated light in a furnished room") {
  for (const Finish finish : {Finish::diffuse, Finish::mirror, Finish::glossy, Finish::glass}) {
    const CheckedRoom room(finish);
    const CheckPoints places = points_of(*room.scene, 200, 5);
    const std::vector<PointLight> given = read(room, places);
    const ErrorEstimate found = check_error(room.scene, places, given, {}, Parallel(2));
    // The same points: what differs is the noise of both, 0.6 of the error at most here, so a tenth of it in the mean.
    const double expected = error_by_paths(room, places, given, 4000);
    CAPTURE(int(finish));
    CAPTURE(found.noise);
    CHECK(found.error == doctest::Approx(expected).epsilon(0.25));
    CHECK(found.low <= found.error);
    CHECK(found.high >= found.error);
  }
}

TEST_CASE("error_check: the answer does not depend on the threads") {
  const CheckedRoom room;
  const CheckPoints places = points_of(*room.scene, 50, 6);
  const std::vector<PointLight> given = read(room, places);
  const ErrorEstimate one = check_error(room.scene, places, given, {}, Parallel(1)),
                      two = check_error(room.scene, places, given, {}, Parallel(2));
  CHECK(one.error == two.error);
  CHECK(one.rays == two.rays);
}

TEST_CASE("error_check: relative to each point's own light, by path tracing as well") {
  const CheckedRoom room;
  CheckPoints places = points_of(*room.scene, 200, 8, true);
  places.norm = ErrorNorm::of_each;
  const std::vector<PointLight> given = read(room, places);
  const ErrorEstimate found = check_error(room.scene, places, given, {}, Parallel(2));
  CHECK(found.error == doctest::Approx(error_by_paths(room, places, given, 4000)).epsilon(0.25));
}

TEST_CASE("error_check: a solution that has not heard of the light vouches for nothing") {
  // No light has been shot: the walks alone tell, wherever they meet what is lit.
  const CheckedRoom room;
  const LitScene dark(uniform_solution(room.scene->trace().shared_scene(), 0.4, 0, 0));
  const auto scene = std::make_shared<LitScene>(uniform_solution(room.scene->trace().shared_scene(), 0.4, 0, 0));
  const CheckPoints places = points_of(dark, 100, 9);
  const ErrorEstimate found =
      check_error(scene, places, std::vector<PointLight>(places.points.size()), {}, Parallel(2));
  CHECK(found.error == doctest::Approx(1).epsilon(0.05));
  CHECK(found.bias == doctest::Approx(-1));
}

TEST_CASE("error_check: white is as bright as it gets") {
  const Furnace furnace(1, 0.8);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  CheckPoints places = points_of(*scene, 64, 3, true);
  places.white = 0.5 * furnace.total();
  const Rgb direct{furnace.direct()};
  const auto error_of = [&](double total) {
    const std::vector<PointLight> given(places.points.size(), {direct, Rgb{total} - direct});
    return check_error(scene, places, given, {}, Parallel(2)).error;
  };
  CHECK(error_of(2 * furnace.total()) < 1e-4);
  CHECK(error_of(0.6 * furnace.total()) < 1e-4);
  CHECK(error_of(0.4 * furnace.total()) == doctest::Approx(0.2).epsilon(1e-3));
}
