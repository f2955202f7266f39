/// Many of everything: arrivals, shots, faces, cells and threads.
#include <sys/resource.h>

#include "core/light/kernels/kernels.hpp"
#include "tests/stability/whole_runs.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// A room of 4 x 4 x 3 m; its floor is part of one triangle of 17 m, its table top is `tiles` tiny ones.
std::shared_ptr<const Scene> huge_and_tiny(std::size_t tiles) {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = add_material(*scene, diffuse(0.6)), lamp = add_material(*scene, luminous(10, 0.3));
  add_box(*scene, {0, 0, 0}, {4, 4, 3}, wall, true);
  scene->surfaces[4].corners = {{-4, -4, 0}, {13, -4, 0}, {-4, 13, 0}};
  scene->surfaces[4].area = area(scene->surfaces[4].corners);
  add_rectangle(*scene, {1.5, 1.5, 2.8}, {0, 1, 0}, {1, 0, 0}, lamp);
  const auto along = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(tiles) / 2)));
  const double edge = 1.0 / static_cast<double>(along);
  scene->surfaces.reserve(scene->surfaces.size() + 2 * along * along);
  for (std::size_t i = 0; i < along; ++i)
    for (std::size_t k = 0; k < along; ++k) {
      const Vec3 a{1.5 + static_cast<double>(i) * edge, 1.5 + static_cast<double>(k) * edge, 0.8}, x{edge, 0, 0},
          y{0, edge, 0};
      add_polygon(*scene, {a, a + x, a + x + y}, wall);
      add_polygon(*scene, {a, a + x + y, a + y}, wall);
    }
  return scene;
}

double peak_memory_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: after 1e7 arrivals a sum holds all of them") {
    for (const Kernels& kernel : available_kernels()) {
      Factors16 factors{};
      clear_segments(factors.segments);
      Sums16 sums;
      const float value[3] = {1e-3f, 0.7f, 1234.5f};
      constexpr int arrivals = 10'000'000;
      for (int lane = 0; lane < 16; ++lane) factors.factor[lane] = 1e-4f * static_cast<float>(lane + 1);
      for (int i = 0; i < arrivals; ++i) kernel.accumulate16(factors, nullptr, value, sums);
      for (int c = 0; c < 3; ++c)
        for (int lane = 0; lane < 16; ++lane) {
          const double exact = double(value[c] * factors.factor[lane]) * arrivals;
          // Half an ulp of the rest's own rest: 2^-24 of 2^-24, 1e7 times.
          REQUIRE(double(sums.value[c][lane]) + double(sums.rest[c][lane]) == doctest::Approx(exact).epsilon(1e-7));
        }
    }
  }

  TEST_CASE("stability: shooting to eps 1e-9 ends, and adds what was still to come") {
    const auto scene = two_rooms();
    Wanted wanted;
    wanted.patch_size = 1;
    const auto mesh = lit_mesh(*scene, wanted);
    wanted.eps = 1e-9;
    const Solution far = solved(scene, mesh, wanted);
    for (const double eps : {5e-4, 1e-6}) {
      wanted.eps = eps;
      const Solution early = solved(scene, mesh, wanted);
      const double difference = rms_difference(element_light(early), element_light(far));
      MESSAGE("eps " << eps << ": " << early.counters.shots << " shots, " << difference << " from the end after "
                     << far.counters.shots);
      CHECK(difference < 200 * eps);  // every group may keep eps of the largest one's power: as for the order of shots
    }
    CHECK(std::abs(far.energy.unshot) < 1e-6 * far.energy.emitted);
  }

  TEST_CASE("stability: energy never grows") {
    const auto scene = two_rooms();
    OneCell cell(scene, mesh_with(*scene, 1));
    const CellPower before = cell.light.power();
    const double end_w = 1e-6 * cell.light.largest_initial_power();
    double most = 0;
    for (auto next = cell.light.strongest(); next.power_w > end_w; next = cell.light.strongest()) {
      cell.shoot(next.group);
      const CellPower now = cell.light.power();
      for (int c = 0; c < 3; ++c) most = std::max(most, (now.absorbed[c] + now.unshot[c]) / before.emitted[c]);
    }
    MESSAGE("largest energy over emitted: " << most);
    CHECK(most < 1.01);  // irradiance is taken at element centres: the midpoint rule's error on this mesh
  }

  TEST_CASE("stability: threads change no bit; cells and the order of shots hardly anything") {
    const auto scene = two_rooms();
    Wanted wanted;
    wanted.patch_size = 0.5;
    wanted.eps = 1e-3;
    const auto mesh = lit_mesh(*scene, wanted);
    const Solution one = solved(scene, mesh, wanted);
    wanted.threads = 2;
    CHECK(solved(scene, mesh, wanted).irradiance == one.irradiance);
    wanted.threads = 1;
    constexpr double places[] = {0.11, 0.37, 0.62, 0.93};
    const std::vector<SensorPoint> points = points_inside(Vec3{0.0}, {8, 4, 2.5}, places);
    const std::vector<Rgb> light_one = light_at(one, points);
    for (const CellPosition& cells : {CellPosition{2, 1, 1}, CellPosition{2, 2, 1}, CellPosition{3, 2, 2}}) {
      wanted.cells = cells;
      const double difference = rms_difference(light_at(solved(scene, mesh, wanted), points), light_one);
      MESSAGE(cells[0] << "x" << cells[1] << "x" << cells[2] << " cells: " << difference);
      CHECK(difference < 0.03);  // hemicubes of 128 pixels, a room of patches of half a metre: 2 % as measured
    }
  }

  TEST_CASE("stability: one huge triangle and very many tiny ones") {
    std::vector<std::size_t> counts{100'000};
    if (long_trials()) counts = {1'000'000, 10'000'000};
    constexpr double places[] = {0.12, 0.52, 0.83};
    const std::vector<SensorPoint> points = points_inside(Vec3{0.0}, {4, 4, 3}, places);
    Wanted wanted;
    wanted.patch_size = 0.2;  // of half a metre, the table's two triangles alone cost 3 %
    wanted.eps = 1e-2;
    const std::vector<Rgb> few = light_at(solved(huge_and_tiny(2), wanted), points);
    wanted.patch_size = 0.5;
    for (const std::size_t count : counts) {
      const double difference = rms_difference(light_at(solved(huge_and_tiny(count), wanted), points), few);
      MESSAGE(count << " tiny triangles: difference " << difference << ", up to now " << peak_memory_gib() << " GiB");
      CHECK(difference < 0.02);
    }
  }
}
