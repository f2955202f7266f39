/// Closed rooms that shine alike on all walls: E/(1-ρ) everywhere, however white the walls.
#include "tests/stability/whole_runs.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// What single precision leaves: an element's form factors are exact to 3e-6 each, of either sign, and sum to 1 within 2e-6.
constexpr double furnace_error = 1e-5;
/// On faces, at edges and in corners of the unit cube.
constexpr double places[] = {0.0004, 0.004, 0.05, 0.21, 0.5, 0.73, 0.97};

double worst_in_furnace(double reflectance, const CellPosition& cells, double eps) {
  const Furnace furnace(1, reflectance);
  Wanted wanted;
  wanted.patch_size = 0.25;
  wanted.cells = cells;
  wanted.eps = eps;
  const Solution solution = solved(furnace.scene, wanted);
  double worst = 0;
  for (const Rgb& light : light_at(solution, points_inside(Vec3{0.0}, Vec3{1.0}, places)))
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(light[c] / furnace.total() - 1));
  MESSAGE("reflectance " << reflectance << ", cells " << cells[0] << "x" << cells[1] << "x" << cells[2] << ", eps "
                         << eps << ": worst " << worst << ", " << solution.counters.shots << " shots, residual "
                         << solution.energy.residual());
  return worst;
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: furnaces of reflectance .5, .9 and .99 are uniform within 1e-5 at every point") {
    for (const double reflectance : {0.5, 0.9, 0.99})
      CHECK(worst_in_furnace(reflectance, {1, 1, 1}, 1e-7) < furnace_error);
    for (const CellPosition& cells : {CellPosition{2, 2, 1}, CellPosition{2, 2, 2}})
      for (const double reflectance : {0.5, 0.9}) CHECK(worst_in_furnace(reflectance, cells, 1e-7) < furnace_error);
    if (long_trials())
      for (const CellPosition& cells : {CellPosition{2, 2, 1}, CellPosition{2, 2, 2}})
        CHECK(worst_in_furnace(0.99, cells, 1e-7) < furnace_error);
  }

  TEST_CASE("stability: a furnace of reflectance 1 - 1e-4 ends, and at the right light") {
    CHECK(worst_in_furnace(1 - 1e-4, {1, 1, 1}, 5e-4) < 2e-3);
  }
}
