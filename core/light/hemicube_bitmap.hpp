/// One bit per hemicube pixel: 1 = a patch nearer to the shooter than the addressed cell covers it (Fig. 2).
///
/// What a cell needs to know of all the cells between it and a shooter: looked up per receiver (visibility), asked per
/// cell (covers), joined where two or three paths meet (merge), and sent in a few hundred bytes (packed).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/expected.hpp"
#include "core/light/hemicube.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

class HemicubeBitmap {
 public:
  static constexpr std::uint32_t min_resolution = 8, max_resolution = 1024;

  /// No pixels at all, resolution 0: only to be assigned to.
  HemicubeBitmap() = default;
  /// All pixels free. @pre resolution even, 8..1024
  explicit HemicubeBitmap(std::uint32_t resolution);

  std::uint32_t resolution() const { return resolution_; }
  bool covered(std::uint32_t pixel) const { return (words_[pixel >> 6] >> (pixel & 63)) & 1; }
  void cover(std::uint32_t pixel) { words_[pixel >> 6] |= 1ull << (pixel & 63); }
  /// Covers the pixels [first, end). @pre end ≤ pixel_count @cost one operation per 64 pixels
  void cover_run(std::uint32_t first, std::uint32_t end) {
    if (first >= end) return;
    const std::uint32_t last = end - 1;
    std::uint64_t mask = ~0ull << (first & 63);
    std::uint32_t word = first >> 6;
    for (; word < last >> 6; ++word, mask = ~0ull) words_[word] |= mask;
    words_[word] |= mask & (~0ull >> (63 - (last & 63)));
  }
  /// True when all pixels [first, end) are covered; an empty run is.
  bool covered_run(std::uint32_t first, std::uint32_t end) const {
    if (first >= end) return true;
    const std::uint32_t last = end - 1;
    std::uint64_t mask = ~0ull << (first & 63);
    std::uint32_t word = first >> 6;
    for (; word < last >> 6; ++word, mask = ~0ull) {
      if ((words_[word] & mask) != mask) return false;
    }
    mask &= ~0ull >> (63 - (last & 63));
    return (words_[word] & mask) == mask;
  }
  std::size_t covered_count() const;
  /// The join of two paths (Fig. 3, 4): a pixel is covered if either path covers it. @pre equal resolution
  void merge(const HemicubeBitmap& other);

  /// Visible share in [0, 1] towards a local direction: bilinear between the four nearest pixel centres of the same
  /// face; beyond the outermost centres the nearest ones count. z ≤ 0 gives 0. @cost about 25 ns
  float visibility(const Vec3& local_direction) const;
  /// The same for 16 local directions (of any length); lanes with z ≤ 0 or not-a-number give 0. @cost 65 to 100 ns
  void visibility16(const float* x, const float* y, const float* z, float* out) const;

  /// True when visibility() is 0 towards every point of the box: nothing in it can be lit. A box behind the base plane
  /// is covered; one before it that holds the centre never is. Errs on the side of false, by a hundredth of a pixel.
  /// @param box  world (m), may be flat
  /// @cost  0.1 µs where the centre or a corner sees a free pixel; otherwise 1 to 3 µs at R = 128
  bool covers(const HemicubeFrame& frame, const Box& box) const;

  /// Bit i of word i / 64 is pixel i; bits beyond the last pixel are 0.
  const std::vector<std::uint64_t>& words() const { return words_; }
  bool operator==(const HemicubeBitmap&) const = default;

 private:
  friend Expected<HemicubeBitmap> unpacked(const std::vector<std::uint8_t>& bytes);
  std::uint32_t resolution_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Compressed wire form: resolution and length, then zstd over the runs of the change from row to row.
/// @cost about 15 µs at R = 128
std::vector<std::uint8_t> packed(const HemicubeBitmap& bitmap);
/// @error bad_input when the bytes are not exactly one bitmap of a plausible resolution; nothing is trusted, and never
///        more than twice the largest bitmap (384 KiB) is allocated
Expected<HemicubeBitmap> unpacked(const std::vector<std::uint8_t>& bytes);

}  // namespace lichthof
