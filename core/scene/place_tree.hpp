/// How one of the places that a patch shoots from is divided into elements that receive: a quadtree of three levels.
#pragma once

#include <cstdint>

namespace lichthof {

/// One bit for each node that has quarters: bit 0 is the place, bits 1 to 4 are its quarters, bits 5 to 20 the quarters of
/// those; a level's nodes lie row by row. All bits 0: the place is one element.
class PlaceTree {
 public:
  static constexpr int most_levels = 3;

  struct Node {
    int level = 0;  ///< 0 to 3: 1, 2x2, 4x4 or 8x8 nodes; those of the last have no quarters
    int column = 0, row = 0;
    Node quarter(int right, int down) const { return {level + 1, 2 * column + right, 2 * row + down}; }
    Node parent() const { return {level - 1, column / 2, row / 2}; }
  };

  PlaceTree() = default;
  /// @param bits  as bits() gave them; those of nodes that are no part of the tree are left out
  explicit PlaceTree(std::uint32_t bits) {
    for (int level = 0; level < most_levels; ++level)
      for (int row = 0; row < 1 << level; ++row)
        for (int column = 0; column < 1 << level; ++column) {
          const Node node{level, column, row};
          if ((bits & bit_of(node)) && (level == 0 || is_divided(node.parent()))) bits_ |= bit_of(node);
        }
  }
  /// 1, 4, 16 or 64 equal elements.
  static PlaceTree uniform(int levels) {
    PlaceTree tree;
    for (int level = 0; level < levels; ++level) tree.bits_ |= level_bits(level);
    return tree;
  }

  bool is_divided(const Node& node) const { return node.level < most_levels && (bits_ & bit_of(node)) != 0; }
  /// Gives quarters to a node, and to all that it lies in. @param node  not of the last level
  void divide(Node node) {
    for (; node.level >= 0; node = node.parent()) bits_ |= bit_of(node);
  }

  /// 0 to 3.
  int levels() const {
    int levels = 0;
    while (levels < most_levels && (bits_ & level_bits(levels))) ++levels;
    return levels;
  }
  /// How many elements it makes of the place, 1 to 64.
  std::uint32_t leaf_count() const {
    std::uint32_t divided = 0;
    for (std::uint32_t bits = bits_; bits; bits &= bits - 1) ++divided;
    return 1 + 3 * divided;
  }
  std::uint32_t bits() const { return bits_; }
  bool operator==(const PlaceTree&) const = default;

 private:
  static constexpr std::uint32_t first_bit(int level) { return ((1u << 2 * level) - 1) / 3; }  // 0, 1, 5
  static constexpr std::uint32_t bit_of(const Node& node) {
    return 1u << (first_bit(node.level) + static_cast<std::uint32_t>((node.row << node.level) + node.column));
  }
  static constexpr std::uint32_t level_bits(int level) { return ((1u << (1u << 2 * level)) - 1) << first_bit(level); }

  std::uint32_t bits_ = 0;
};

}  // namespace lichthof
