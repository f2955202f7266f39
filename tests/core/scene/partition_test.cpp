#include "core/scene/partition.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
CellGrid three_by_two() { return CellGrid(Box{{0, 0, 0}, {3, 2, 1}}, {{{1, 2}, {1}, {}}}); }
}  // namespace

TEST_SUITE("partition") {
  TEST_CASE("partition: positions, numbers, boxes and points of a grid belong together") {
    const CellGrid grid = three_by_two();
    CHECK(grid.cell_count() == 6);
    CHECK(grid.dimensions() == 2);
    for (CellId cell{0}; cell.value < 6; ++cell.value) {
      CHECK(grid.at(grid.position(cell)) == cell);
      CHECK(grid.cell_of(grid.box(cell).centre()) == cell);
    }
    CHECK(grid.position(CellId{5}) == CellPosition{2, 1, 0});
    CHECK(grid.box(CellId{4}).lo == Vec3{1, 1, 0});
    CHECK(grid.cell_of(Vec3{-5, 9, 9}) == CellId{3});  // outside: the nearest outer cell
    CHECK(grid.box({0, 0, 0}, {2, 0, 0}).hi == Vec3{3, 1, 1});
  }

  TEST_CASE("partition: blocks follow the cuts") {
    const CellGrid grid(Box{{0, 0, 0}, {5, 1, 1}}, {{{0, 1, 2, 3, 4, 5}, {0, 1}, {0, 1}}}, {{{2, 4}, {}, {}}});
    const std::uint32_t expected[] = {0, 0, 1, 1, 2};
    for (std::uint16_t block = 0; block < 5; ++block)
      CHECK(grid.cell_of(std::array<std::uint16_t, 3>{block, 0, 0}).value == expected[block]);
    CHECK(grid.box(CellId{1}).lo.x == 2);
    CHECK(grid.box(CellId{1}).hi.x == 4);
  }

  TEST_CASE("partition: --cells is a count or a product") {
    REQUIRE(cells_wanted("8"));
    CHECK(cells_wanted("8")->count == 8);
    CHECK(!cells_wanted("8")->along);
    REQUIRE(cells_wanted("4x2"));
    CHECK(*cells_wanted("4x2")->along == CellPosition{4, 2, 1});
    REQUIRE(cells_wanted("4X2x3"));
    CHECK(*cells_wanted("4X2x3")->along == CellPosition{4, 2, 3});
    CHECK(cells_wanted("4X2x3")->count == 24);
  }

  TEST_CASE("partition: what is no number of cells is refused with the option's name") {
    for (const char* text : {"", "0", "4x0", "x", "4x", "x4", "-1", "4*2", "1x2x3x4", "70000", "999x999",
                             "99999999999999999999", "2 x 2", "3.5"}) {
      CAPTURE(text);
      const auto wanted = cells_wanted(text);
      REQUIRE(!wanted);
      CHECK(wanted.error().code == ErrorCode::bad_input);
      CHECK(wanted.error().where == "--cells");
    }
  }

  TEST_CASE("partition: a mesh with too few block lines is an error that says what to do") {
    Mesh mesh;
    mesh.lines = {{{0, 1, 2}, {0, 1}, {0, 1}}};
    const Box bounds{{0, 0, 0}, {2, 1, 1}};
    CHECK(partition(mesh, bounds, {2, std::nullopt}));
    const auto grid = partition(mesh, bounds, {3, std::nullopt});
    REQUIRE(!grid);
    CHECK(grid.error().message.find("2x1x1") != std::string::npos);
    CHECK(!partition(mesh, bounds, {2, CellPosition{1, 2, 1}}));
  }

  TEST_CASE("partition: dormant groups weigh nothing") {
    Mesh mesh;
    mesh.lines = {{{0, 1, 2, 3, 4}, {0, 1}, {0, 1}}};
    for (std::uint16_t block = 0; block < 4; ++block) {
      Group group;
      group.patch_count = block == 0 ? 9 : 3;
      group.block = {block, 0, 0};
      mesh.groups.push_back(group);
    }
    mesh.group_is_lit = {0, 1, 1, 1};
    const auto grid = partition(mesh, Box{{0, 0, 0}, {4, 1, 1}}, {3, CellPosition{3, 1, 1}});
    REQUIRE(grid);
    CHECK(patch_counts(mesh, *grid) == std::vector<std::uint32_t>{3, 3, 3});
  }
}
