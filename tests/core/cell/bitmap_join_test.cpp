#include "core/cell/bitmap_join.hpp"

#include <doctest/doctest.h>

#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

constexpr std::uint32_t resolution = 16;

/// A shot from the corner cell of a cube of eight, towards the opposite corner: three bitmaps meet there.
struct Cube {
  test::ToyWorld world = test::toy_world({2, 2, 2}, 0, 1);
  std::shared_ptr<Shot> shot = std::make_shared<Shot>();
  const CellId far_corner{7};
  Cube() {
    test::ToyPatch patch;
    patch.centre = {0.3, 0.3, 0.3};
    patch.normal = glm::normalize(Vec3{1, 1, 1});
    patch.area = 0.25;
    patch.emission = Rgb{1.0};
    world.patches[0] = {patch};
    *shot = test::ToyLight(world, CellId{0}).take_shot(GroupId{0}, {CellId{0}, 0}, {});
  }
  HemicubeMessage part(CellId from, std::uint32_t first_covered) const {
    HemicubeBitmap bitmap(resolution);
    bitmap.cover_run(first_covered, first_covered + 10);
    return {shot, from, false, packed(bitmap)};
  }
  HemicubeMessage closed(CellId from) const { return {shot, from, true, {}}; }
};

constexpr CellId below{3}, left{5}, behind{6};  // (1,1,0), (1,0,1), (0,1,1)
using Filed = BitmapJoin::Filed;

}  // namespace

TEST_SUITE("bitmap_join") {
  TEST_CASE("bitmap_join: three parts in 3-D, in any order, join by OR") {
    const Cube cube;
    for (const auto& order :
         {std::array{below, left, behind}, std::array{behind, below, left}, std::array{left, behind, below}}) {
      BitmapJoin join(cube.far_corner, resolution);
      CHECK(join.file(*cube.world.grid, cube.part(order[0], 20 * order[0].value)) == Filed::waiting);
      CHECK(join.file(*cube.world.grid, cube.part(order[1], 20 * order[1].value)) == Filed::waiting);
      CHECK(join.waiting_shots() == 1);
      CHECK(join.waiting_parts() == 2);
      REQUIRE(join.file(*cube.world.grid, cube.part(order[2], 20 * order[2].value)) == Filed::complete);
      const ExternalShot joined = join.take();
      CHECK(joined.parts == 3);
      CHECK(joined.bitmap.covered_count() == 30);
      for (const CellId from : order) CHECK(joined.bitmap.covered(20 * from.value + 9));
      CHECK(joined.power_w == doctest::Approx(0.75));
      CHECK(join.waiting_parts() == 0);
    }
  }

  TEST_CASE("bitmap_join: one closed part closes the join, but all parts are waited for") {
    const Cube cube;
    BitmapJoin join(cube.far_corner, resolution);
    CHECK(join.file(*cube.world.grid, cube.closed(below)) == Filed::waiting);
    CHECK(join.file(*cube.world.grid, cube.part(left, 0)) == Filed::waiting);
    REQUIRE(join.file(*cube.world.grid, cube.part(behind, 50)) == Filed::complete);
    const ExternalShot joined = join.take();
    CHECK(joined.closed);
    CHECK(joined.parts == 3);
  }

  TEST_CASE("bitmap_join: duplicates are refused, also long after the join is complete") {
    const Cube cube;
    BitmapJoin join(cube.far_corner, resolution);
    join.file(*cube.world.grid, cube.part(below, 0));
    CHECK(join.file(*cube.world.grid, cube.part(below, 0)) == Filed::refused);
    join.file(*cube.world.grid, cube.part(left, 0));
    REQUIRE(join.file(*cube.world.grid, cube.part(behind, 0)) == Filed::complete);
    join.take();
    for (const CellId from : {below, left, behind})
      CHECK(join.file(*cube.world.grid, cube.part(from, 0)) == Filed::refused);
    CHECK(join.waiting_shots() == 0);
  }

  TEST_CASE("bitmap_join: a second copy that differs from the first is refused, the first stays") {
    const Cube cube;
    BitmapJoin join(cube.far_corner, resolution);
    join.file(*cube.world.grid, cube.part(below, 0));
    HemicubeMessage forged = cube.part(left, 0);
    auto other = std::make_shared<Shot>(*forged.shot);
    other->centre += Vec3{0.1};
    forged.shot = other;
    CHECK(join.file(*cube.world.grid, forged) == Filed::refused);
    CHECK(join.file(*cube.world.grid, cube.part(left, 0)) == Filed::waiting);
  }
}
