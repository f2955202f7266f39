/// The same scene at other sizes, in other places, turned: the same light.
#include "tests/stability/whole_runs.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double places[] = {0.11, 0.37, 0.62, 0.93};
const Vec3 near_corner{0.0}, far_corner{8, 4, 2.5};

struct Lit {
  Solution solution;
  std::vector<Rgb> at_points;
};

Lit lit(const Carriage& carriage) {
  Wanted wanted;
  wanted.patch_size =
      0.9 * carriage.size;  // no edge is a round number of patches long: rounding must not choose the mesh
  wanted.eps = 1e-3;
  const auto scene = carried(*two_rooms(), carriage);
  Solution solution = solved(scene, wanted);
  std::vector<Rgb> at_points =
      light_without_chance(solution, carried(points_inside(near_corner, far_corner, places), carriage));
  return {std::move(solution), std::move(at_points)};
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: a scene 2^20 times larger or smaller has the same light, bit for bit") {
    const Lit one = lit({});
    for (const double size : {0x1p20, 0x1p-20}) {
      const Lit other = lit({size});
      CAPTURE(size);
      CHECK(other.solution.counters.shots == one.solution.counters.shots);
      CHECK(other.solution.irradiance == one.solution.irradiance);
      CHECK(largest_difference(other.at_points, one.at_points) == 0);
    }
  }

  TEST_CASE("stability: size 1e-6 to 1e6, and a place 1e6 sizes from the origin, change light by rounding alone") {
    const Lit one = lit({});
    for (const double size : {1e-6, 1e-3, 1e3, 1e6}) {
      const Lit other = lit({size});
      const double difference = rms_difference(other.at_points, one.at_points);
      MESSAGE("size " << size << ": " << difference);
      CHECK(difference < 1e-4);
    }
    for (const double sizes : {1e3, 1e6}) {
      const Lit other = lit({1, 8.0 * sizes * Vec3{1, -0.7, 0.4}});
      const double difference = rms_difference(other.at_points, one.at_points);
      MESSAGE(sizes << " sizes off: " << difference);
      CHECK(difference < 1e-3);
    }
  }

  TEST_CASE("stability: turned, in millimetres, far from the origin: the same light within the mesh's error") {
    const Lit one = lit({});
    const Lit other = lit({1e3, {3e8, -2e8, 5e8}, tilted()});
    const double difference = rms_difference(other.at_points, one.at_points);
    MESSAGE("turned and far: " << difference);
    CHECK(difference < 0.03);
  }
}
