#include "core/cell/box_cover.hpp"

#include <algorithm>
#include <array>

#include "core/light/bit_projector.hpp"

namespace lichthof {

namespace {

/// The sides of the box that face the point, as polygons.
std::array<std::array<Vec3, 4>, 3> facing_sides(const Box& box, const Vec3& point, int& count) {
  std::array<std::array<Vec3, 4>, 3> sides;
  count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_below = point[axis] < box.lo[axis];
    if (!is_below && !(point[axis] > box.hi[axis])) continue;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<Vec3, 4>& side = sides[static_cast<std::size_t>(count++)];
    for (std::size_t k = 0; k < 4; ++k) {
      side[k][axis] = is_below ? box.lo[axis] : box.hi[axis];
      side[k][u] = k == 1 || k == 2 ? box.hi[u] : box.lo[u];
      side[k][v] = k >= 2 ? box.hi[v] : box.lo[v];
    }
  }
  return sides;
}

}  // namespace

bool hides(const HemicubeBitmap& bitmap, const HemicubeFrame& frame, const Box& box) {
  // Most boxes are not hidden, and most of those show it at their centre.
  const Vec3 middle = frame.to_local(box.centre() - frame.centre);
  if (middle.z > 0 && !bitmap.covered(pixel_of(middle, bitmap.resolution()))) return false;

  int count = 0;
  const auto sides = facing_sides(box, frame.centre, count);
  HemicubeBitmap seen(bitmap.resolution());
  for (int k = 0; k < count; ++k) project(frame, sides[static_cast<std::size_t>(k)], seen);
  bool is_seen = false;
  for (std::size_t word = 0; word < seen.words().size(); ++word) {
    if (seen.words()[word] & ~bitmap.words()[word]) return false;
    is_seen = is_seen || seen.words()[word] != 0;
  }
  return is_seen || bitmap.covers(frame, box);
}

}  // namespace lichthof
