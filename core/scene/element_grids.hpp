/// The elements of patches by their places in the patches' grids.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// A place holds the element that covers it; one that is larger than the smallest of its patch is held by several.
class ElementGrids {
 public:
  static constexpr std::uint32_t none = 0xffffffffu;

  /// @param mesh  must outlive this
  explicit ElementGrids(const Mesh& mesh) : mesh_(&mesh) {
    first_.reserve(mesh.patches.size());
    for (const Patch& patch : mesh.patches) {
      MUST(places_.size() < none);
      first_.push_back(static_cast<std::uint32_t>(places_.size()));
      places_.resize(places_.size() + std::size_t{patch.columns} * patch.rows, none);
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        const Element& element = mesh.elements[e];
        for (int row = element.row; row < element.row + element.span; ++row)
          for (int column = element.column; column < element.column + element.span; ++column)
            places_[first_.back() + static_cast<std::size_t>(row * patch.columns + column)] = e;
      }
    }
  }

  /// The element at a place of a patch's grid; none where the polygon leaves nothing.
  std::uint32_t at(std::uint32_t patch, int column, int row) const {
    return places_[first_[patch] + static_cast<std::size_t>(row * mesh_->patches[patch].columns + column)];
  }

  /// Calls `each` with every element that has a place in columns [left, right) and rows [top, bottom), once.
  template <class Each>
  void for_each_in(std::uint32_t patch, int left, int right, int top, int bottom, Each&& each) const {
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) {
        const std::uint32_t e = at(patch, column, row);
        if (e == none) continue;
        const Element& element = mesh_->elements[e];
        // A large one is met in several places: the first is enough.
        if (column == std::max<int>(element.column, left) && row == std::max<int>(element.row, top)) each(e);
      }
  }

  std::size_t memory_bytes() const { return bytes_of_all(first_, places_); }

 private:
  const Mesh* mesh_;
  std::vector<std::uint32_t> first_;   ///< of each patch, in places_
  std::vector<std::uint32_t> places_;  ///< elements of all grids, row by row
};

}  // namespace lichthof
