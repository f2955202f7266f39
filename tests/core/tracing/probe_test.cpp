#include "core/tracing/probe.hpp"

#include <doctest/doctest.h>

#include <numbers>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {
std::vector<Rgb> probed(const Solution& solution, const std::vector<SensorPoint>& points, ProbeOptions options = {}) {
  std::uint64_t rays = 0;
  return sensor_irradiance(std::make_shared<LitScene>(solution), points, options, Parallel(1), rays);
}
}  // namespace

TEST_CASE("probe: the furnace is π Ke/(1-ρ) at every sensor, on walls, in corners and in free air") {
  for (const double reflectance : {0.5, 0.9}) {
    const Furnace furnace(1, reflectance);
    const std::vector<SensorPoint> points{{{0.5, 0.5, 0}, {0, 0, 1}},
                                          {{0, 0.3090124, 0.2281398}, {1, 0, 0}},
                                          {{0.999, 0.001, 0}, {0, 0, 3}},
                                          {{0.4, 0.5, 0.6}, {0.6, 0.7, -0.4}},
                                          {{0.7, 1, 0.2}, {0, -1, 0}}};
    for (const auto method : {IndirectMethod::gather, IndirectMethod::interpolate}) {
      ProbeOptions options;
      options.indirect = method;
      for (const Rgb& irradiance : probed(furnace.solution(), points, options))
        CHECK(irradiance.x == doctest::Approx(furnace.total()).epsilon(2e-5));
    }
  }
}

TEST_CASE("probe: a point written a little above or below its surface is not shadowed by it") {
  const PanelRoom room;
  const Solution dark = uniform_solution(room.scene, 0.5, 0, 0);
  const std::vector<Rgb> irradiance =
      probed(dark, {{{2, 1.75, 0}, {0, 0, 1}}, {{2, 1.75, 1e-6}, {0, 0, 1}}, {{2, 1.75, -1e-6}, {0, 0, 1}}});
  for (const Rgb& value : irradiance) CHECK(value.x == doctest::Approx(105.78).epsilon(1e-4));
}

TEST_CASE("probe: light is counted on the side the normal points to") {
  const PanelRoom room;
  const std::vector<Rgb> irradiance =
      probed(uniform_solution(room.scene, 0.5, 0, 0),
             {{{2, 2, 1}, {0, 0, 1}}, {{2, 2, 1}, {0, 0, -1}}, {{2, 2, 0}, {0, 0, -1}}});
  CHECK(irradiance[0].x > 100);
  CHECK(irradiance[1].x == 0);
  CHECK(irradiance[2].x == 0);
}

TEST_CASE("probe: results are the same for any number of threads") {
  const Furnace furnace(1, 0.5);
  const auto scene = std::make_shared<LitScene>(furnace.solution());
  std::vector<SensorPoint> points;
  for (int i = 0; i < 100; ++i) points.push_back({{0.3, i / 100.0, 0.4}, {1, 0.1 * i, 1}});
  std::uint64_t one = 0, two = 0;
  CHECK(sensor_irradiance(scene, points, {}, Parallel(1), one) ==
        sensor_irradiance(scene, points, {}, Parallel(2), two));
  CHECK(one == two);
}
