#include "core/cluster/placement.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <map>

#include "core/base/random.hpp"

using namespace lichthof;

namespace {

CellsToPlace row(std::vector<std::uint32_t> patches) {
  const auto count = static_cast<std::uint32_t>(patches.size());
  return {{count, 1, 1}, std::move(patches), 1, 0};
}

std::vector<Seat> roomy(const std::vector<double>& speeds) {
  std::vector<Seat> seats;
  for (std::uint32_t k = 0; k < speeds.size(); ++k) seats.push_back({NodeId{k}, speeds[k], 1'000'000, 0, 2});
  return seats;
}

/// The best of all placements, by trying them.
double best_finish(const CellsToPlace& cells, const std::vector<Seat>& seats) {
  std::vector<NodeId> nodes(cells.patches.size());
  double best = std::numeric_limits<double>::infinity();
  for (;;) {
    best = std::min(best, finishing_time(cells, seats, nodes));
    std::size_t digit = 0;
    while (digit < nodes.size() && ++nodes[digit].value == seats.size()) nodes[digit++].value = 0;
    if (digit == nodes.size()) return best;
  }
}

CellsToPlace drawn(Random& random, const std::array<std::uint32_t, 3>& grid) {
  CellsToPlace cells{grid, {}, 10, 50};
  for (std::uint32_t k = 0; k < grid[0] * grid[1] * grid[2]; ++k) cells.patches.push_back(random.below(40));
  return cells;
}

constexpr Placement all_heuristics[] = {Placement::round_robin, Placement::proportional, Placement::neighbours};
constexpr double rounding = 1e-12;  // of a handful of additions and one division

}  // namespace

TEST_SUITE("placement") {
  TEST_CASE("placement: on equal nodes proportional keeps Graham's bound of the optimum") {
    Random random(1);
    for (int round = 0; round < 60; ++round) {
      const std::uint32_t m = 2 + random.below(2);
      CellsToPlace cells = row({});
      cells.grid = {3 + random.below(5), 1, 1};
      for (std::uint32_t k = 0; k < cells.grid[0]; ++k) cells.patches.push_back(1 + random.below(30));
      const auto seats = roomy(std::vector<double>(m, 2.0));
      const auto nodes = cells_on_nodes(Placement::proportional, cells, seats);
      REQUIRE(nodes);
      CHECK(finishing_time(cells, seats, *nodes) <=
            (4.0 / 3 - 1.0 / (3 * m)) * best_finish(cells, seats) * (1 + rounding));
    }
  }

  TEST_CASE("placement: on nodes of different speed it keeps the bound of Gonzalez, Ibarra and Sahni") {
    Random random(2);
    for (int round = 0; round < 60; ++round) {
      const std::uint32_t m = 2 + random.below(2);
      std::vector<double> speeds;
      for (std::uint32_t k = 0; k < m; ++k) speeds.push_back(1 + random.below(8));
      CellsToPlace cells = row({});
      cells.grid = {3 + random.below(4), 1, 1};
      for (std::uint32_t k = 0; k < cells.grid[0]; ++k) cells.patches.push_back(1 + random.below(30));
      const auto seats = roomy(speeds);
      const auto nodes = cells_on_nodes(Placement::proportional, cells, seats);
      REQUIRE(nodes);
      CHECK(finishing_time(cells, seats, *nodes) <= (2 - 2.0 / (m + 1)) * best_finish(cells, seats) * (1 + rounding));
    }
  }

  TEST_CASE("placement: round_robin ignores speed, proportional follows it and what a node carries already") {
    const CellsToPlace cells = row({10, 10, 10, 10});
    auto seats = roomy({3, 1});
    CHECK(*cells_on_nodes(Placement::round_robin, cells, seats) ==
          std::vector<NodeId>{NodeId{0}, NodeId{1}, NodeId{0}, NodeId{1}});
    CHECK(*cells_on_nodes(Placement::proportional, cells, seats) ==
          std::vector<NodeId>{NodeId{0}, NodeId{0}, NodeId{0}, NodeId{1}});
    seats[0].load = 100;
    CHECK(*cells_on_nodes(Placement::proportional, cells, seats) ==
          std::vector<NodeId>{NodeId{1}, NodeId{1}, NodeId{1}, NodeId{0}});
  }

  TEST_CASE("placement: neighbours crosses fewer pairs at nearly the same finish") {
    CellsToPlace cells{{8, 8, 1}, std::vector<std::uint32_t>(64, 100), 1, 0};
    const auto seats = roomy({1, 1, 1, 1});
    const auto balanced = cells_on_nodes(Placement::proportional, cells, seats);
    const auto compact = cells_on_nodes(Placement::neighbours, cells, seats);
    CHECK(crossings(cells.grid, *compact) * 2 < crossings(cells.grid, *balanced));
    Random random(3);
    for (int round = 0; round < 100; ++round) {
      cells = drawn(random, {1 + random.below(4), 1 + random.below(4), 1 + random.below(3)});
      const auto some = roomy({1.0 + random.below(4), 1.0 + random.below(4), 2});
      const auto fast = cells_on_nodes(Placement::proportional, cells, some);
      const auto near = cells_on_nodes(Placement::neighbours, cells, some);
      CHECK(crossings(cells.grid, *near) <= crossings(cells.grid, *fast));
      CHECK(finishing_time(cells, some, *near) <= 1.1 * finishing_time(cells, some, *fast) * (1 + rounding));
    }
  }

  TEST_CASE("placement: no node gets more than its memory, every cell has a node, twice the same") {
    Random random(4);
    int placed = 0;
    for (int round = 0; round < 600; ++round) {
      const CellsToPlace cells = drawn(random, {1 + random.below(4), 1 + random.below(3), 1 + random.below(2)});
      std::vector<Seat> seats;
      for (std::uint32_t k = 0; k < 1 + random.below(4); ++k)
        seats.push_back({NodeId{k + 5}, 1.0 + random.below(9), random.below(3000), double(random.below(50)), 1});
      for (const Placement heuristic : all_heuristics) {
        const auto nodes = cells_on_nodes(heuristic, cells, seats);
        const auto again = cells_on_nodes(heuristic, cells, seats);
        REQUIRE(bool(nodes) == bool(again));
        if (!nodes) continue;
        ++placed;
        CHECK(*nodes == *again);
        REQUIRE(nodes->size() == cells.patches.size());
        std::map<NodeId, std::uint64_t> used;
        for (std::size_t cell = 0; cell < nodes->size(); ++cell) {
          const bool is_first = !used.contains((*nodes)[cell]);
          used[(*nodes)[cell]] += cells.bytes(cell) + (is_first ? cells.base_bytes : 0);
        }
        for (const auto& [node, bytes] : used) {
          const auto seat =
              std::find_if(seats.begin(), seats.end(), [id = node](const Seat& s) { return s.node == id; });
          REQUIRE(seat != seats.end());
          CHECK(bytes <= seat->free_bytes);
        }
      }
    }
    CHECK(placed > 300);
  }

  TEST_CASE("placement: where speed leads into a wall it packs") {
    // Longest first puts 6 on the one and 5 + 4 on the other, where 3 no longer fits beside 6.
    const CellsToPlace cells = row({6, 5, 4, 3});
    const std::vector<Seat> seats = {{NodeId{0}, 1, 9, 0, 1}, {NodeId{1}, 100, 9, 0, 1}};
    const auto nodes = cells_on_nodes(Placement::proportional, cells, seats);
    REQUIRE(nodes);
    CHECK((*nodes)[0] == (*nodes)[3]);
  }

  TEST_CASE("placement: without the memory the error says what is needed and what is there") {
    CellsToPlace cells = row({5, 5});
    cells.bytes_per_patch = 1'000'000;
    cells.base_bytes = 2'000'000;
    const std::vector<Seat> seats = {{NodeId{0}, 1, 7'000'000, 0, 1}, {NodeId{1}, 1, 6'999'999, 0, 1}};
    const auto nodes = cells_on_nodes(Placement::neighbours, cells, seats);
    REQUIRE(!nodes);
    CHECK(nodes.error().message ==
          "2 cells need 10 MB and 2 MB more on each node; the largest of 2 nodes has 7 MB free");
    CHECK(cells_on_nodes(Placement::neighbours, cells, {}).error().message == "no node is there to host anything");
  }

  TEST_CASE("placement: ray workers go wherever the memory holds the picture, a thread for each core") {
    auto seats = roomy({1, 1, 1});
    seats[1].free_bytes = 99;
    seats[2].cores = 0;
    const auto workers = workers_on_nodes(100, seats);
    REQUIRE(workers);
    REQUIRE(workers->size() == 2);
    CHECK((*workers)[0] == std::pair{NodeId{0}, 2u});
    CHECK((*workers)[1] == std::pair{NodeId{2}, 1u});
    CHECK(!workers_on_nodes(1'000'001, seats));
  }
}
