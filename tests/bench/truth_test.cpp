#include "bench/truth.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::bench;
using lichthof::test::PanelRoom;

TEST_SUITE("bench") {
  TEST_CASE("truth: points lie on the surfaces, each as often as its area says") {
    const PanelRoom room(.5);
    const std::atomic<bool> stop = false;
    const BenchCase scene(room.scene, 1, stop);
    const std::vector<SensorPoint> points = surface_points(*scene.mesh(), 4000, 1);
    REQUIRE(points.size() == 4000);
    std::size_t on_floor = 0, on_west_wall = 0;
    for (const SensorPoint& sensor : points) {
      const Vec3 &p = sensor.point, &n = sensor.normal;
      // The room is 4 x 4 x 3 m and closed: normals look inwards.
      const double plane = n.z > .5    ? p.z
                           : n.z < -.5 ? 3 - p.z
                           : n.x > .5  ? p.x
                           : n.x < -.5 ? 4 - p.x
                           : n.y > .5  ? p.y
                                       : 4 - p.y;
      CHECK(std::abs(plane) < 1e-9);
      on_floor += n.z > .5, on_west_wall += n.x > .5;
    }
    // Of 80 m², floor and wall have 16 and 12; four standard deviations of a binomial draw.
    const double floor_share = .2, wall_share = .15;
    CHECK(std::abs(on_floor - 4000 * floor_share) < 4 * std::sqrt(4000 * floor_share * (1 - floor_share)));
    CHECK(std::abs(on_west_wall - 4000 * wall_share) < 4 * std::sqrt(4000 * wall_share * (1 - wall_share)));
    CHECK(surface_points(*scene.mesh(), 10, 1)[7].point == points[7].point);
    CHECK(surface_points(*scene.mesh(), 10, 2)[7].point != points[7].point);
  }

  TEST_CASE("truth: two estimates differ by both their standard errors, whose squares add") {
    const PanelRoom room(.5);
    const std::atomic<bool> stop = false;
    const BenchCase scene(room.scene, 1, stop);
    const std::vector<SensorPoint> points = surface_points(*scene.mesh(), 400, 1);
    const PathTracer tracer(std::make_shared<const LitScene>(scene.scene()));
    const Parallel parallel(2);
    const auto rough = path_traced(scene, tracer, points, 64, 1, parallel);
    const auto fine = path_traced(scene, tracer, points, 256, 2, parallel);
    REQUIRE((rough && fine));
    std::vector<Rgb> some;
    for (const Estimate& estimate : *rough) some.push_back(estimate.mean);
    const double measured = relative_error(some, *fine), noise = standard_error(*fine);
    // All channels are alike, so there are 400 draws: their RMS is sure to 1/√800 = 3.5 %, and tails are a bit heavier than
    // normal. Three of twice that.
    constexpr double tolerance = .21;
    CHECK(noise < measured / 2);
    CHECK(without_noise(measured, noise) == doctest::Approx(standard_error(*rough)).epsilon(tolerance));
    // Independent paths of the same number: twice the variance of one.
    const auto other = path_traced(scene, tracer, points, 64, 3, parallel);
    REQUIRE(other);
    CHECK(relative_error(some, *other) == doctest::Approx(std::sqrt(2) * standard_error(*rough)).epsilon(tolerance));
    CHECK(relative_error(some, *path_traced(scene, tracer, points, 64, 1, Parallel(1))) == 0);
  }

  TEST_CASE("truth: estimates merge by their paths") {
    const Estimate a{Rgb{1}, Rgb{.4}}, b{Rgb{2}, Rgb{.2}};
    const Estimate both = merged(a, 100, b, 300);
    CHECK(both.mean.y == doctest::Approx(1.75));
    CHECK(both.standard_error.y == doctest::Approx(std::hypot(.1, .15)));
    CHECK(merged({}, 0, b, 300).mean.x == 2);
    CHECK(merged({}, 0, b, 300).standard_error.x == doctest::Approx(.2));
    CHECK(without_noise(.05, .03) == doctest::Approx(.04));
    CHECK(without_noise(.03, .05) == 0);
  }

  TEST_CASE("truth: a set flag ends it") {
    const PanelRoom room(.5);
    const std::atomic<bool> stop = true;
    const BenchCase scene(room.scene, 1, stop);
    const PathTracer tracer(std::make_shared<const LitScene>(scene.scene()));
    const auto traced = path_traced(scene, tracer, surface_points(*scene.mesh(), 10, 1), 2, 1, Parallel(1));
    REQUIRE_FALSE(traced);
    CHECK(traced.error().code == ErrorCode::interrupted);
  }
}
