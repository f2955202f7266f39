/// Which hemicube pixels a polygon covers, row by row: the part that the bit and the item projector share.
///
/// Nothing is clipped or divided by depth: a pixel's centre ray meets a convex polygon if it lies on the inner side of
/// every plane through the hemicube's centre and an edge [Olano97]. On a face those planes are straight lines, so that
/// corners behind the base plane, beside the face or next to the centre need no case of their own. Polygons that share
/// an edge share its line, wherever their other corners are, and every line is moved outwards by more than the rounding
/// of its corners: no gap can open between them.
/// @source [Olano97] M. Olano, T. Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/light/hemicube.hpp"

namespace lichthof {

class PolygonScan {
 public:
  /// Polygons with more corners are given in pieces, see for_each_piece().
  static constexpr std::size_t max_corners = 16;

  /// Takes a polygon. @returns false when no pixel can see it: behind the base plane, or edge-on to the centre
  /// @param corners  convex planar polygon of either winding, world (m). @pre 3..max_corners
  bool set_polygon(const HemicubeFrame& frame, std::span<const Vec3> corners);

  /// Turns to a face. @returns false when the polygon certainly covers no pixel centre of it
  bool set_face(std::uint32_t face, std::uint32_t resolution);

  /// Calls run(row, first column, last column + 1) for the covered pixels of the face, upwards.
  /// A centre on the outline counts as covered: a gap would let light through a wall, an overlap does not matter.
  template <class Run>
  void for_each_run(Run&& run) const {
    for (std::int32_t row = first_row_; row < end_row_; ++row) {
      double left = 0.0, right = last_column_;
      for (std::uint32_t k = 0; k < left_count_; ++k) left = std::max(left, left_[k].slope * row + left_[k].offset);
      for (std::uint32_t k = 0; k < right_count_; ++k)
        right = std::min(right, right_[k].slope * row + right_[k].offset);
      const auto first = static_cast<std::int32_t>(std::ceil(std::min(left, last_column_ + 1.0)));
      const auto end = static_cast<std::int32_t>(std::floor(std::max(right, -1.0))) + 1;
      if (first < end)
        run(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(end));
    }
  }

  /// Corner in the hemicube's local frame (m).
  const Vec3& corner(std::size_t i) const { return corners_[i]; }
  std::size_t corner_count() const { return count_; }

 private:
  /// column = slope · row + offset
  struct Line {
    double slope, offset;
  };
  bool set_edges();
  bool bound_by_corners(std::uint32_t face, double half);
  bool bound_by_edges(std::uint32_t face, double half);
  void add_line(const Vec3& plane, double margin, std::uint32_t face, double half);

  std::size_t count_ = 0;
  double reach_ = 0;   ///< largest local coordinate of a corner (m)
  double origin_ = 0;  ///< largest world coordinate of the centre (m)
  std::array<Vec3, max_corners> corners_;
  std::array<Vec3, max_corners> edges_;      ///< normals of the planes through the centre and an edge, inwards
  std::array<double, max_corners> margins_;  ///< by which a plane is moved outwards
  enum class Edges : std::uint8_t { unknown, known, none } edges_state_ = Edges::unknown;
  std::uint32_t sides_all_ = 0, sides_any_ = 0;  ///< see sides_of() in the source
  std::array<Line, max_corners> left_, right_;
  std::uint32_t left_count_ = 0, right_count_ = 0;
  std::int32_t first_row_ = 0, end_row_ = 0;
  double last_column_ = 0;
};

/// Calls piece(corners) for convex pieces of at most max_corners corners: a fan around corner 0.
template <class Piece>
void for_each_piece(std::span<const Vec3> corners, Piece&& piece) {
  constexpr std::size_t most = PolygonScan::max_corners;
  if (corners.size() <= most) return piece(corners);
  std::array<Vec3, most> part;
  part[0] = corners[0];
  for (std::size_t first = 1; first + 1 < corners.size(); first += most - 2) {
    const std::size_t count = std::min(most - 1, corners.size() - first);
    std::copy_n(corners.begin() + static_cast<std::ptrdiff_t>(first), count, part.begin() + 1);
    piece(std::span<const Vec3>(part.data(), count + 1));
  }
}

}  // namespace lichthof
