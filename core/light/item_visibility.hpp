/// Visibility as the paper has it: everything that receives in the cell is projected onto the hemicube of each shooting
/// patch. (The paper's patches both shoot and receive; what receives here are elements.) Method `hemicube`, on the same mesh
/// and with the same form factors as the default, to compare with.
#pragma once

#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/light/cell_light.hpp"
#include "core/light/item_projector.hpp"

namespace lichthof {

/// The polygons of a cell that can hide each other: its elements, dormant ones included.
class ElementOutlines {
 public:
  ElementOutlines(const Mesh& mesh, std::span<const GroupId> groups);

  struct Outline {
    Polygon corners;          ///< world (m)
    Vec3 normal;
    std::uint32_t plane = 0;  ///< PlaneId of the side that is lit
    bool both_sides = false;  ///< the other side has elements of its own
  };
  const std::vector<Outline>& outlines() const { return outlines_; }

 private:
  void add(const Mesh& mesh, const Patch& patch);
  std::vector<Outline> outlines_;
};

/// The hemicubes of a shot, one over the centre of each of its patches.
class ItemVisibility {
 public:
  /// @param incoming  bitmap of nearer cells, or nullptr
  /// @cost  R² pixels and every outline, for every patch: 1 to 10 ms
  /// @source paper §2; [Cohen85], [Baum89]
  ItemVisibility(const Shot& shot, const ElementOutlines& outlines, const HemicubeBitmap* incoming, std::uint32_t resolution,
                 const Parallel& parallel);

  /// Does the patch's centre see the point (world, m) of that plane?
  bool sees(std::size_t shot_patch, const Vec3& point, std::uint32_t plane) const {
    return buffers_[shot_patch].sees(frames_[shot_patch], point, plane, plane_of_item_[shot_patch]);
  }

 private:
  std::vector<HemicubeFrame> frames_;
  std::vector<ItemBuffer> buffers_;
  std::vector<std::vector<std::uint32_t>> plane_of_item_;
};

}  // namespace lichthof
