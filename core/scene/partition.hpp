/// The rectilinear partition of a scene into cells, and how its cuts are chosen (§2: "cell boundaries can only be placed
/// along edges of the grid", "subscenes with nearly the same number of patches within every cell").
///
/// A CellGrid is the only place that knows which block, group or point lies in which cell. Cells are numbered with x
/// running fastest. It is built once, from the mesh alone, so every process that has the mesh builds the same one.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/ids.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// Place of a cell in the grid: index along x, y, z.
using CellPosition = std::array<std::uint32_t, 3>;

class CellGrid {
 public:
  /// @param bounds  outer box of the grid (m); the outer cells reach to it
  /// @param lines   block lines along x, y, z, ascending (m); the first and the last are ends, not boundaries
  /// @param cuts    per axis the indices into `lines` where a cell ends and the next begins, ascending, inner lines only
  /// @pre every cut lies strictly inside the bounds
  CellGrid(const Box& bounds, std::array<std::vector<double>, 3> lines, std::array<std::vector<std::uint32_t>, 3> cuts);
  /// A grid that is given by its boundaries alone: every cell is one block.
  CellGrid(const Box& bounds, const std::array<std::vector<double>, 3>& boundaries);

  std::uint32_t cell_count() const { return size_[0] * size_[1] * size_[2]; }
  const CellPosition& size() const { return size_; }
  /// Number of axes with more than one cell: 0 for the undivided scene; at most that many bitmaps join (§2).
  std::uint32_t dimensions() const;
  const Box& bounds() const { return bounds_; }

  CellPosition position(CellId cell) const;
  CellId at(const CellPosition& position) const;
  Box box(CellId cell) const;
  /// Box around the cells from position `lo` to position `hi`, both included.
  Box box(const CellPosition& lo, const CellPosition& hi) const;

  CellId cell_of(const std::array<std::uint16_t, 3>& block) const;
  /// The cell that holds a point; points outside belong to the nearest outer cell.
  CellId cell_of(const Vec3& point) const;

 private:
  Box bounds_;
  std::array<std::vector<std::uint32_t>, 3> cuts_;
  std::array<std::vector<double>, 3> edges_;  ///< size_ + 1 per axis: bounds, boundaries, bounds
  CellPosition size_{1, 1, 1};
};

/// What `--cells` asks for.
struct CellsWanted {
  std::uint32_t count = 1;            ///< cells in all
  std::optional<CellPosition> along;  ///< cells along x, y, z; none: the partitioner factors `count` itself
};

/// Most cells a partition may have: a bound on what a typing error can allocate.
constexpr std::uint32_t max_cells = 65536;

/// Reads "8" (count), "4x2" (along x and y) or "4x2x2".
/// @error bad_input with where = "--cells"
Expected<CellsWanted> cells_wanted(std::string_view text);

/// Chooses the cuts so that the fullest cell holds as few patches as can be: quantiles of the marginal counts first, then
/// single cuts are moved while that lowers the maximum. A bare count tries every factorisation; among those within
/// 5 % of the best balance the one with the least boundary area wins (fewer bitmaps cross it, and rooms stay whole).
///
/// @param mesh    patches of dormant groups do not count: nobody works on them
/// @param bounds  box of the scene; the outer cells reach to it (or to the outer block lines, where it is flat)
/// @error bad_input when an axis has fewer block lines than the wanted cells need
/// @cost  O(patches + blocks) + about 1 ms per factorisation
Expected<CellGrid> partition(const Mesh& mesh, const Box& bounds, const CellsWanted& wanted);

/// Patches of lit groups per cell.
std::vector<std::uint32_t> patch_counts(const Mesh& mesh, const CellGrid& grid);

/// The groups of every cell, dormant ones included.
std::vector<std::vector<GroupId>> groups_by_cell(const Mesh& mesh, const CellGrid& grid);

}  // namespace lichthof
