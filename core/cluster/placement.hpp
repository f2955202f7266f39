/// Which node hosts which cell of a job: it alone weighs speed, memory and neighbourhood against each other.
///
/// A node's finishing time is (load + patches hosted)/speed; the latest one is what a placement is judged by. Longest first
/// onto the node that would finish earliest stays below 4/3 − 1/(3m) of the optimum on m equal nodes [Graham69], below
/// 2 − 2/(m + 1) on nodes of different speed [Gonzalez77], as long as memory forbids nothing.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/ids.hpp"

namespace lichthof {

enum class Placement : std::uint8_t {
  round_robin,   ///< in turn, whatever the speeds: what the others are compared with
  proportional,  ///< longest first onto the node that would finish earliest
  neighbours,  ///< grows regions of adjacent cells, for fewer bitmaps between nodes; at most 1/10 later than proportional
};

/// A node as a placement sees it.
struct Seat {
  NodeId node;
  double speed = 1;  ///< of all its cores together, in any unit; > 0
  std::uint64_t free_bytes = 0;
  double load = 0;  ///< patches of other jobs it hosts already
  std::uint32_t cores = 1;
};

struct CellsToPlace {
  std::array<std::uint32_t, 3> grid{1, 1, 1};
  std::vector<std::uint32_t> patches;  ///< per cell, x fastest; one for each cell of the grid
  std::uint64_t bytes_per_patch = 0;
  std::uint64_t base_bytes = 0;  ///< on each node that hosts a cell, once

  std::uint64_t bytes(std::size_t cell) const { return patches[cell] * bytes_per_patch; }
};

/// The node of every cell. Seats of equal merit are taken in the order given. Where the heuristic runs out of memory,
/// the cells are packed, largest first onto the largest node, whatever the speeds.
/// @pre    the bytes of all cells add up below 2^63
/// @error  no seat, or their memory does not hold the cells (packing is not exact: a tight fit may be missed)
/// @cost   O(cells · (log cells + seats))
Expected<std::vector<NodeId>> cells_on_nodes(Placement heuristic, const CellsToPlace& cells,
                                             std::span<const Seat> seats);

/// Latest finishing time of the nodes, in patches per speed.
/// @pre every node of `nodes_of_cells` has its seat
double finishing_time(const CellsToPlace& cells, std::span<const Seat> seats, std::span<const NodeId> nodes_of_cells);

/// Pairs of adjacent cells on different nodes: what bitmaps have to cross.
std::uint32_t crossings(const std::array<std::uint32_t, 3>& grid, std::span<const NodeId> nodes_of_cells);

/// The ray workers of a picture, as many threads as a node has cores, on every node whose memory holds `bytes`.
/// @error no seat, or none with that much memory
Expected<std::vector<std::pair<NodeId, std::uint32_t>>> workers_on_nodes(std::uint64_t bytes,
                                                                         std::span<const Seat> seats);

}  // namespace lichthof
