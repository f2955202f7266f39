#include "core/scene/block_lines.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// A ground of 100 x 100 m, and a wall of 4 m standing in its middle.
struct WallOnGround {
  Scene scene;
  std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
  WallOnGround() {
    test::add_rectangle(scene, {-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, grey);
    test::add_rectangle(scene, {-2, 0, 0}, {4, 0, 0}, {0, 0, 3}, grey);
  }
  const Box box() const { return bounds(scene); }
};

}  // namespace

TEST_SUITE("block_lines") {
  TEST_CASE("block_lines: widths are those of the finest lit side at a place, and of none where nothing is lit") {
    const WallOnGround s;
    const std::vector<LitSides> coarse{{true, false, 4, 0}, {true, false, 0, 0}};
    const BlockWidths widths(s.scene, coarse, 0, 0.5);
    CHECK(widths.finest() == 0.5);
    CHECK(widths.at(0) == 0.5);
    CHECK(widths.at(2) == 0.5);
    CHECK(widths.at(2.1) == 1);  // blocks double, 1 + 2 + 4 m, on the way to 8 m
    CHECK(widths.at(9.1) == 8);
    CHECK(widths.count(-2, 2) == doctest::Approx(8));
    CHECK(widths.count(-50, 50) == doctest::Approx(8 + 2 * (3 + 41 / 8.0)));
    CHECK(widths.count(-60, 60) == doctest::Approx(8 + 2 * (3 + 41 / 8.0)));

    CHECK(BlockWidths(s.scene, coarse, 1, 0.5).at(0) == 0.5);  // the wall is seen edge-on
    CHECK(BlockWidths(s.scene, coarse, 1, 0.5).at(0.1) == 1);

    const BlockWidths of_wall(s.scene, std::vector<LitSides>{{false, false, 0, 0}, {true, false, 0, 0}}, 0, 0.5);
    CHECK(of_wall.count(-50, 50) == doctest::Approx(8));
    const BlockWidths of_none(s.scene, std::vector<LitSides>{{false, false, 0, 0}, {false, false, 0, 0}}, 0, 0.5);
    CHECK(of_none.count(-50, 50) == 0);
  }

  TEST_CASE("block_lines: lines are dense only where a fine side reaches, and ascend") {
    const WallOnGround s;
    const std::vector<LitSides> coarse{{true, false, 4, 0}, {true, false, 0, 0}};
    for (const int axis : {0, 1, 2}) {
      const auto lines = block_lines(s.scene, s.box(), axis, BlockWidths(s.scene, coarse, axis, 0.5));
      CHECK(std::is_sorted(lines.begin(), lines.end()));
      CHECK(std::adjacent_find(lines.begin(), lines.end()) == lines.end());
      CHECK(lines.front() == s.box().lo[axis]);
      CHECK(lines.back() == s.box().hi[axis]);
    }
    const auto lines = block_lines(s.scene, s.box(), 0, BlockWidths(s.scene, coarse, 0, 0.5));
    const auto inside = std::count_if(lines.begin(), lines.end(), [](double x) { return x >= -2 && x <= 2; });
    CHECK(inside >= 9);
    CHECK(lines.size() < 40);
  }
}
