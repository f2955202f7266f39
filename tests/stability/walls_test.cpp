/// Walls as thin as paper, and what lies behind them.
#include "tests/stability/whole_runs.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double room_size = 4;

const Vec3 inner_lo{1.3, 1.2, 0.4}, inner_hi{2.9, 2.7, 1.9};

/// A lit room of 4 x 4 x 3 m with a closed box in it, whose walls are two sheets `thickness` apart; 0: one sheet.
Scene box_in_a_room(double thickness) {
  Scene scene;
  const std::uint32_t grey = add_material(scene, diffuse(0.8));
  add_box(scene, {0, 0, 0}, {4, 4, 3}, grey, true);
  add_box(scene, inner_lo, inner_hi, grey, true);
  if (thickness > 0) add_box(scene, inner_lo - thickness, inner_hi + thickness, grey, false);
  add_rectangle(scene, {0.4, 0.4, 2.9}, {0, 1, 0}, {1, 0, 0}, add_material(scene, luminous(10, 0.5)));
  return scene;
}

struct Leak {
  double elements = 0, points = 0;  ///< largest irradiance inside the box (W/m²)
};

Leak leak(const Scene& scene, const Carriage& carriage, const CellPosition& cells) {
  Wanted wanted;
  wanted.cells = cells;
  wanted.patch_size = 0.5 * carriage.size;
  wanted.eps = 3e-3;
  const auto there = carried(scene, carriage);
  Leak leak;
  // First pass, on a mesh that takes every side for lit: what arrives, without an estimate of what may still come.
  MeshOptions options;
  options.patch_size = wanted.patch_size;
  const Solution all = solved(there, std::make_shared<const Mesh>(mesh_of(*there, options, {})), wanted);
  double brightest = 0;
  for (const Patch& patch : all.mesh->patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const bool inside = patch.surface.value >= 6 && patch.surface.value < 12 && !patch.back;
      if (inside) leak.elements = std::max(leak.elements, double(all.irradiance[e].x));
      brightest = std::max(brightest, double(all.irradiance[e].x));
    }
  CHECK(brightest > 1);
  // Both passes, as the program runs them.
  constexpr double places[] = {0.0002, 0.09, 0.5, 0.83};
  std::vector<SensorPoint> points = points_inside(inner_lo, inner_hi, places);
  points.push_back({0.5 * (inner_lo + inner_hi), {0.3, -0.8, 0.5}});
  const Solution lit = solved(there, wanted);
  for (const Rgb& light : light_at(lit, carried(points, carriage)))
    leak.points = std::max(leak.points, max_channel(light));
  return leak;
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: a closed box with the lamp outside reads exactly 0, its walls down to 1e-5 of the scene") {
    const auto expect_none = [](const Leak& leak) {
      CHECK(leak.elements == 0);
      CHECK(leak.points == 0);
    };
    for (const double share : {0.0, 1e-1, 1e-3, 1e-5}) {
      const Scene scene = box_in_a_room(share * room_size);
      CAPTURE(share);
      expect_none(leak(scene, {}, {1, 1, 1}));
      expect_none(leak(scene, {1, {3, 2, 1}, tilted()}, {1, 1, 1}));
    }
    // Through other cells light is judged from the hemicube's centre: what could get in there is kept out by the mesh, which
    // has no patches where no light gets.
    for (const CellPosition& cells : {CellPosition{2, 2, 1}, CellPosition{2, 2, 2}}) {
      CAPTURE(cells[2]);
      CHECK(leak(box_in_a_room(1e-5 * room_size), {}, cells).points == 0);
      CHECK(leak(box_in_a_room(0), {1, {3, 2, 1}, tilted()}, cells).points == 0);
    }
  }
}
