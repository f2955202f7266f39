#include "core/light/lit_sides.hpp"

#include <doctest/doctest.h>

#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// A floor, a grey box above it, and a lamp above or inside that box.
struct BoxOnFloor {
  Scene scene;
  std::uint32_t grey = test::add_material(scene, test::diffuse(0.5)), lamp = test::add_material(scene, test::luminous(10));
  BoxOnFloor() { test::add_rectangle(scene, {-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, grey); }
  void lamp_at(double z) { test::add_rectangle(scene, {-0.2, -0.2, z}, {0, 0.4, 0}, {0.4, 0, 0}, lamp); }  // faces down
  std::vector<LitSides> lit() const { return test::lit_sides_of(scene, 0.25); }
};

}  // namespace

TEST_SUITE("lit_sides") {
  TEST_CASE("lit_sides: the inside of a closed box with the lamp outside is dark") {
    BoxOnFloor s;
    test::add_box(s.scene, {-1, -1, 0.5}, {1, 1, 2}, s.grey, false);
    s.lamp_at(3);
    const auto lit = s.lit();
    CHECK(lit[0].front);
    for (int face = 1; face <= 6; ++face) {
      CAPTURE(face);
      CHECK(lit[face].front);
      CHECK_FALSE(lit[face].back);
    }
    CHECK(lit[7].front);
  }

  TEST_CASE("lit_sides: with the lamp inside, the outside is dark") {
    BoxOnFloor s;
    test::add_box(s.scene, {-1, -1, 0.5}, {1, 1, 2}, s.grey, true);
    s.lamp_at(1.5);
    const auto lit = s.lit();
    CHECK_FALSE(lit[0].front);
    for (int face = 1; face <= 6; ++face) {
      CHECK(lit[face].front);
      CHECK_FALSE(lit[face].back);
    }
    CHECK(lit[7].front);
    CHECK(lit[7].back);  // by the ceiling above it
  }

  TEST_CASE("lit_sides: a box without a bottom is dark inside when it stands on a floor") {
    BoxOnFloor s;
    test::add_box(s.scene, {-1, -1, 0}, {1, 1, 1}, s.grey, false);
    s.scene.surfaces.erase(s.scene.surfaces.begin() + 5);  // its -z face
    s.lamp_at(3);
    const auto lit = s.lit();
    CHECK(lit[0].front);
    for (int face = 1; face <= 5; ++face) {
      CHECK(lit[face].front);
      CHECK_FALSE(lit[face].back);
    }
  }

  TEST_CASE("lit_sides: a single sheet in a lit room is lit on both sides") {
    BoxOnFloor s;
    test::add_box(s.scene, {-2, -2, 0}, {2, 2, 4}, s.grey, true);
    test::add_rectangle(s.scene, {-0.5, -0.5, 1}, {1, 0, 0}, {0, 1, 0}, s.grey);
    s.lamp_at(3);
    const auto lit = s.lit();
    CHECK(lit[7].front);
    CHECK(lit[7].back);
  }

  TEST_CASE("lit_sides: a room without a lamp is dormant, its lit neighbour is not") {
    BoxOnFloor s;
    test::add_box(s.scene, {-1, -1, 0.5}, {1, 1, 2}, s.grey, true);
    test::add_box(s.scene, {1.2, -1, 0.5}, {3, 1, 2}, s.grey, true);
    s.lamp_at(1.5);
    const auto lit = s.lit();
    for (int face = 1; face <= 6; ++face) CHECK(lit[face].front);
    for (int face = 7; face <= 12; ++face) {
      CHECK_FALSE(lit[face].front);
      CHECK_FALSE(lit[face].back);
    }
  }

  TEST_CASE("lit_sides: without luminaires nothing is lit") {
    BoxOnFloor s;
    for (const LitSides& sides : s.lit()) CHECK((!sides.front && !sides.back));
  }

  TEST_CASE("lit_sides: the answer does not depend on the number of threads") {
    BoxOnFloor s;
    test::add_box(s.scene, {-1, -1, 0.1}, {1, 1, 2}, s.grey, false);
    s.lamp_at(3);
    const RayScene rays(s.scene, s.scene.surfaces, bounds(s.scene).centre(), Glass::clear);
    const auto one = lit_sides(s.scene, rays, 0.5, Parallel(1)), two = lit_sides(s.scene, rays, 0.5, Parallel(2));
    for (std::size_t k = 0; k < one.size(); ++k) CHECK((one[k].front == two[k].front && one[k].back == two[k].back));
  }
}
