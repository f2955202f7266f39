#include "core/light/coarseness.hpp"

#include <doctest/doctest.h>

#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

/// A room of 4 x 3 x 2.5 m with a lamp and an open side, on a ground of so many metres each way, all times a scale.
Scene room_on_ground(double ground, double scale = 1) {
  Scene scene;
  const std::uint32_t grey = test::add_material(scene, test::diffuse(0.6)),
                      lamp = test::add_material(scene, test::luminous(100));
  test::add_box(scene, {0, 0, 0}, scale * Vec3{4, 3, 2.5}, grey, true);
  scene.surfaces.erase(scene.surfaces.begin());  // -x: open
  test::add_rectangle(scene, scale * Vec3{1.7, 1.2, 2.4}, {0, 0.6 * scale, 0}, {0.6 * scale, 0, 0}, lamp);
  const double g = scale * ground;
  test::add_rectangle(scene, {-g, -g, -0.1 * scale}, {2 * g, 0, 0}, {0, 2 * g, 0}, grey);
  return scene;
}

std::vector<LitSides> coarse_sides_of(const Scene& scene, double patch_size) {
  std::vector<LitSides> lit = test::lit_sides_of(scene, patch_size);
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  find_coarseness(scene, rays, Parallel(1), lit);
  return lit;
}

double lit_elements_in_room(const Scene& scene, const Mesh& mesh) {
  double count = 0;
  for (const Patch& patch : mesh.patches)
    if (patch.surface.value + 1 < scene.surfaces.size() && mesh.group_is_lit[patch.group.value])
      count += patch.element_count;
  return count;
}

}  // namespace

TEST_SUITE("coarseness") {
  TEST_CASE("coarseness: the elements of rooms are even") {
    for (const LitSides& sides : coarse_sides_of(*test::two_rooms(), 0.25)) {
      CHECK(sides.front_coarse == 0);
      CHECK(sides.back_coarse == 0);
    }
  }

  TEST_CASE(
      "coarseness: a mesh has about as many elements as were asked for, and the room keeps its own, on any ground") {
    const Scene alone = room_on_ground(4);
    const double usual = lit_elements_in_room(alone, mesh_of(alone, {}, coarse_sides_of(alone, 0.25)));
    for (const double ground : {30.0, 200.0, 2000.0, 20000.0})
      for (const double scale : {0.001, 1.0, 1000.0}) {
        CAPTURE(ground);
        CAPTURE(scale);
        const Scene scene = room_on_ground(ground, scale);
        const std::vector<LitSides> lit = coarse_sides_of(scene, 0.25 * scale);
        const Mesh mesh = mesh_of(scene, {}, lit);
        CHECK(mesh.elements.size() > 6000);
        CHECK(mesh.elements.size() < 24000);
        CHECK(lit_elements_in_room(scene, mesh) > 0.5 * usual);
        CHECK(forecast_of(scene, {}, lit).elements > 0.3 * static_cast<double>(mesh.elements.size()));
      }
  }

  TEST_CASE("coarseness: the answer does not depend on the number of threads, nor on the unit") {
    const Scene scene = room_on_ground(2000), in_mm = room_on_ground(2000, 0.001);
    const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
    std::vector<LitSides> one(scene.surfaces.size()), two = one;
    find_coarseness(scene, rays, Parallel(1), one);
    find_coarseness(scene, rays, Parallel(2), two);
    const std::vector<LitSides> small = coarse_sides_of(in_mm, 0.00025), large = coarse_sides_of(scene, 0.25);
    for (std::size_t s = 0; s < one.size(); ++s) {
      CHECK(one[s].front_coarse == two[s].front_coarse);
      CHECK(one[s].back_coarse == two[s].back_coarse);
      CHECK(small[s].front_coarse == large[s].front_coarse);
    }
  }
}
