/// The paper's own scheme: an item buffer on the hemicube, the nearest polygon at every pixel. Method `hemicube`.
///
/// The hemicube only says what is visible; form factors stay analytic [Baum89]. Kept to compare with: the error of one
/// centre point does not fall with the resolution (numerics: section 2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/light/hemicube_bitmap.hpp"

namespace lichthof {

class ItemBuffer {
 public:
  static constexpr std::uint32_t no_item = 0xffffffffu;      ///< nothing was projected onto the pixel
  static constexpr std::uint32_t nearer_cell = 0xfffffffeu;  ///< the incoming bitmap covers the pixel

  /// All pixels free. @pre resolution even, 8..1024
  explicit ItemBuffer(std::uint32_t resolution);

  std::uint32_t resolution() const { return resolution_; }
  /// Makes all pixels free, for a local iteration.
  void clear();
  /// Makes those pixels free that the bitmap leaves free, for an external iteration: projections are only allowed on
  /// pixels whose bitmap entry is 0 (§2). @pre equal resolution
  void clear(const HemicubeBitmap& incoming);

  /// Writes the item to every free pixel whose centre ray meets the polygon nearer than what is there already. At equal
  /// depth the earlier item stays.
  /// @param corners  convex planar polygon of either winding, world (m); whoever culls back faces does it before
  /// @param item     below nearer_cell
  /// @cost O(pixels of the polygon)
  void project(const HemicubeFrame& frame, std::span<const Vec3> corners, std::uint32_t item);

  std::uint32_t item(std::uint32_t pixel) const { return items_[pixel]; }
  /// 1 / distance along the axis of the pixel's face (1/m); 0 where nothing is, infinite where a nearer cell covers.
  float inverse_depth(std::uint32_t pixel) const { return inverse_depths_[pixel]; }

  /// True when the centre sees the sample point: the pixel that the point falls into holds an item of its plane. The
  /// pixel's centre ray need not meet the sample's own element, so a neighbour in the same plane will do.
  /// @param plane           plane of the sample point's surface
  /// @param plane_of_item   plane of every item; empty: the items are planes themselves
  /// @returns false for points behind the base plane
  /// @source [Baum89]
  bool sees(const HemicubeFrame& frame, const Vec3& point, std::uint32_t plane,
            std::span<const std::uint32_t> plane_of_item) const;

  /// Covers every pixel that holds an item or was covered before: the bitmap for the cells beyond (Fig. 2).
  /// @pre equal resolution
  void cover(HemicubeBitmap& bitmap) const;

 private:
  std::uint32_t resolution_;
  std::vector<std::uint32_t> items_;
  std::vector<float> inverse_depths_;
};

}  // namespace lichthof
