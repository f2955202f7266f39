/// The lines of the grid that cuts a scene into blocks: on the architecture's edges, and as dense as the finest surface there asks.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/scene/scene.hpp"

namespace lichthof {

/// Which sides of a surface light can reach at all, and how coarse elements do there; index = surface. What no light reaches gets
/// no patches on its back, and a dormant one on its front. See core/light/lit_sides and core/light/coarseness.
struct LitSides {
  bool front = true, back = true;
  std::uint8_t front_coarse = 0, back_coarse = 0;  ///< elements are 2^this times as large as the scene's usual ones
};
/// @pre below 2^31: most_coarse
inline double coarsening(std::uint8_t coarse) { return static_cast<double>(std::uint32_t{1} << coarse); }
inline constexpr std::uint8_t most_coarse = 30;

/// How wide blocks are along one axis, by place: as the finest of the lit sides that reach there asks, and growing with the distance
/// from finer ones; where there are none, without limit.
class BlockWidths {
 public:
  /// @param lit  one entry per surface, or empty for "everything may be lit, and finely"
  /// @param block  m; where elements are of the usual size
  BlockWidths(const Scene& scene, std::span<const LitSides> lit, int axis, double block);
  /// The narrowest of all (m); infinite where nothing is lit.
  double finest() const;
  /// The narrowest that touches the place (m).
  double at(double coordinate) const;
  /// Blocks between two places, as a real number.
  double count(double lo, double hi) const;
  /// The lines that cut what lies between two places into so many parts of equal count(), the first place included and the
  /// second not.
  void add_parts(double lo, double hi, int parts, std::vector<double>& lines) const;

 private:
  struct Stretch {
    double lo, hi, width;
  };
  /// Beside finer ones, blocks double from one to the next: the ground beside a window gets its light by its distance.
  void grade();

  std::vector<Stretch> stretches_;  ///< ascending, without gaps
};

/// Block lines along one axis: on the strongest edges of the architecture (weighted by their length), with uniform lines
/// between. Lines through the walls save the slivers that a blind grid leaves beside them.
std::vector<double> block_lines(const Scene& scene, const Box& box, int axis, const BlockWidths& widths);

/// Index of the block between lines[k] and lines[k + 1] that holds the coordinate.
std::size_t block_of(const std::vector<double>& lines, double coordinate);

}  // namespace lichthof
