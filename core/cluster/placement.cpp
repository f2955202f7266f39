#include "core/cluster/placement.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <string>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

/// How much later than `proportional` a placement by neighbourhood may finish. A tenth is about what the estimate of a
/// cell's work by its patches is worth.
constexpr double neighbourhood_slack = 1.1;

using Indices = std::vector<std::size_t>;

/// Seats while they are being filled.
class Filling {
 public:
  Filling(const CellsToPlace& cells, std::span<const Seat> seats)
      : cells_(cells), seats_(seats), used_(seats.size(), 0), hosts_(seats.size(), false),
        seat_of_(cells.patches.size()) {
    for (const Seat& seat : seats) load_.push_back(seat.load);
  }

  bool fits(std::size_t cell, std::size_t seat) const {
    const std::uint64_t base = hosts_[seat] ? 0 : cells_.base_bytes;
    const std::uint64_t left = seats_[seat].free_bytes - used_[seat];
    return base <= left && cells_.bytes(cell) <= left - base;
  }
  double finish_with(std::size_t cell, std::size_t seat) const {
    return (load_[seat] + cells_.patches[cell]) / seats_[seat].speed;
  }
  void put(std::size_t cell, std::size_t seat) {
    used_[seat] += cells_.bytes(cell) + (hosts_[seat] ? 0 : cells_.base_bytes);
    hosts_[seat] = true;
    load_[seat] += cells_.patches[cell];
    seat_of_[cell] = seat;
  }
  /// Neighbours of a cell that have been put onto a seat.
  std::uint32_t neighbours_on(std::size_t cell, std::size_t seat) const {
    std::uint32_t found = 0;
    std::size_t stride = 1;
    for (const std::uint32_t size : cells_.grid) {
      const std::size_t position = cell / stride % size;
      if (position > 0) found += seat_of_[cell - stride] == seat;
      if (position + 1 < size) found += seat_of_[cell + stride] == seat;
      stride *= size;
    }
    return found;
  }
  std::vector<NodeId> nodes() const {
    std::vector<NodeId> nodes;
    for (const auto& seat : seat_of_) nodes.push_back(seats_[*seat].node);
    return nodes;
  }

 private:
  const CellsToPlace& cells_;
  std::span<const Seat> seats_;
  std::vector<double> load_;
  std::vector<std::uint64_t> used_;
  std::vector<bool> hosts_;
  std::vector<std::optional<std::size_t>> seat_of_;
};

using Placed = std::optional<std::vector<NodeId>>;

Indices counted(std::size_t size) {
  Indices indices(size);
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

Indices largest_first(const CellsToPlace& cells) {
  Indices order = counted(cells.patches.size());
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return cells.patches[a] > cells.patches[b]; });
  return order;
}

Placed in_turn(const CellsToPlace& cells, std::span<const Seat> seats) {
  Filling filling(cells, seats);
  std::size_t turn = 0;
  for (std::size_t cell = 0; cell < cells.patches.size(); ++cell) {
    std::size_t tried = 0;
    while (tried < seats.size() && !filling.fits(cell, (turn + tried) % seats.size())) ++tried;
    if (tried == seats.size()) return std::nullopt;
    filling.put(cell, (turn + tried) % seats.size());
    turn += tried + 1;
  }
  return filling.nodes();
}

Placed longest_first(const CellsToPlace& cells, std::span<const Seat> seats) {
  Filling filling(cells, seats);
  for (const std::size_t cell : largest_first(cells)) {
    std::optional<std::size_t> best;
    for (std::size_t seat = 0; seat < seats.size(); ++seat)
      if (filling.fits(cell, seat) && (!best || filling.finish_with(cell, seat) < filling.finish_with(cell, *best)))
        best = seat;
    if (!best) return std::nullopt;
    filling.put(cell, *best);
  }
  return filling.nodes();
}

/// The cells row by row, every other row backwards: each touches the one before it.
Indices serpentine(const std::array<std::uint32_t, 3>& grid) {
  Indices order;
  for (std::size_t z = 0; z < grid[2]; ++z)
    for (std::size_t j = 0; j < grid[1]; ++j) {
      const std::size_t y = z % 2 == 0 ? j : grid[1] - 1 - j;
      for (std::size_t i = 0; i < grid[0]; ++i) {
        const std::size_t x = (z * grid[1] + j) % 2 == 0 ? i : grid[0] - 1 - i;
        order.push_back(x + grid[0] * (y + std::size_t{grid[1]} * z));
      }
    }
  return order;
}

/// Regions that grow along the serpentine; nobody may finish after `deadline`.
Placed by_neighbourhood(const CellsToPlace& cells, std::span<const Seat> seats, double deadline) {
  Filling filling(cells, seats);
  for (const std::size_t cell : serpentine(cells.grid)) {
    std::optional<std::size_t> best;
    // Most neighbours first; a new region begins where there is most room.
    const auto merit = [&](std::size_t seat) {
      return std::pair{filling.neighbours_on(cell, seat),
                       (deadline - filling.finish_with(cell, seat)) * seats[seat].speed};
    };
    for (std::size_t seat = 0; seat < seats.size(); ++seat)
      if (filling.fits(cell, seat) && filling.finish_with(cell, seat) <= deadline &&
          (!best || merit(seat) > merit(*best)))
        best = seat;
    if (!best) return std::nullopt;
    filling.put(cell, *best);
  }
  return filling.nodes();
}

Placed packed(const CellsToPlace& cells, std::span<const Seat> seats) {
  Filling filling(cells, seats);
  Indices seat_order = counted(seats.size());
  std::stable_sort(seat_order.begin(), seat_order.end(),
                   [&](std::size_t a, std::size_t b) { return seats[a].free_bytes > seats[b].free_bytes; });
  for (const std::size_t cell : largest_first(cells)) {
    const auto seat =
        std::find_if(seat_order.begin(), seat_order.end(), [&](std::size_t s) { return filling.fits(cell, s); });
    if (seat == seat_order.end()) return std::nullopt;
    filling.put(cell, *seat);
  }
  return filling.nodes();
}

Placed placed(Placement heuristic, const CellsToPlace& cells, std::span<const Seat> seats) {
  if (heuristic == Placement::round_robin) return in_turn(cells, seats);
  Placed balanced = longest_first(cells, seats);
  if (heuristic == Placement::proportional || !balanced) return balanced;
  const double deadline = neighbourhood_slack * finishing_time(cells, seats, *balanced);
  Placed compact = by_neighbourhood(cells, seats, deadline);
  return compact && crossings(cells.grid, *compact) < crossings(cells.grid, *balanced) ? compact : balanced;
}

std::string megabytes(std::uint64_t bytes) {
  return std::to_string(bytes / 1'000'000 + (bytes % 1'000'000 != 0)) + " MB";
}

Error too_little(const std::string& need, std::span<const Seat> seats) {
  if (seats.empty()) return {ErrorCode::failed, {}, "no node is there to host anything"};
  std::uint64_t largest = 0;
  for (const Seat& seat : seats) largest = std::max(largest, seat.free_bytes);
  return {ErrorCode::failed,
          {},
          need + "; the largest of " + std::to_string(seats.size()) + " nodes has " + megabytes(largest) + " free"};
}

}  // namespace

Expected<std::vector<NodeId>> cells_on_nodes(Placement heuristic, const CellsToPlace& cells,
                                             std::span<const Seat> seats) {
  MUST(cells.patches.size() == std::size_t{cells.grid[0]} * cells.grid[1] * cells.grid[2]);
  if (Placed found = placed(heuristic, cells, seats)) return *std::move(found);
  if (Placed found = packed(cells, seats)) return *std::move(found);
  std::uint64_t sum = 0;
  for (std::size_t cell = 0; cell < cells.patches.size(); ++cell) sum += cells.bytes(cell);
  return too_little(std::to_string(cells.patches.size()) + " cells need " + megabytes(sum) + " and " +
                        megabytes(cells.base_bytes) + " more on each node",
                    seats);
}

double finishing_time(const CellsToPlace& cells, std::span<const Seat> seats, std::span<const NodeId> nodes_of_cells) {
  std::map<NodeId, double> patches;
  for (std::size_t cell = 0; cell < cells.patches.size(); ++cell) patches[nodes_of_cells[cell]] += cells.patches[cell];
  double latest = 0;
  for (const Seat& seat : seats)
    if (const auto found = patches.find(seat.node); found != patches.end())
      latest = std::max(latest, (seat.load + found->second) / seat.speed);
  return latest;
}

std::uint32_t crossings(const std::array<std::uint32_t, 3>& grid, std::span<const NodeId> nodes_of_cells) {
  std::uint32_t found = 0;
  std::size_t stride = 1;
  for (const std::uint32_t size : grid) {
    for (std::size_t cell = 0; cell < nodes_of_cells.size(); ++cell)
      if (cell / stride % size + 1 < size) found += nodes_of_cells[cell] != nodes_of_cells[cell + stride];
    stride *= size;
  }
  return found;
}

Expected<std::vector<std::pair<NodeId, std::uint32_t>>> workers_on_nodes(std::uint64_t bytes,
                                                                         std::span<const Seat> seats) {
  std::vector<std::pair<NodeId, std::uint32_t>> workers;
  for (const Seat& seat : seats)
    if (bytes <= seat.free_bytes) workers.emplace_back(seat.node, std::max(1u, seat.cores));
  if (workers.empty()) return too_little("a ray worker needs " + megabytes(bytes), seats);
  return workers;
}

}  // namespace lichthof
