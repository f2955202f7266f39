#include "core/light/item_projector.hpp"

#include <algorithm>
#include <limits>

#include "core/base/check.hpp"
#include "core/light/polygon_scan.hpp"

namespace lichthof {
namespace {

/// Inverse depth of a polygon's plane as seen from the centre: 1/t = g · d for the ray t d. Linear on every face, and
/// it stays exact at grazing angles, where a depth interpolated between the corners does not.
Vec3 inverse_depth_gradient(const PolygonScan& scan) {
  Vec3 normal{0.0}, middle{0.0};
  for (std::size_t i = 1; i + 1 < scan.corner_count(); ++i) {
    normal += glm::cross(scan.corner(i) - scan.corner(0), scan.corner(i + 1) - scan.corner(0));
  }
  for (std::size_t i = 0; i < scan.corner_count(); ++i) middle += scan.corner(i);
  return normal * (static_cast<double>(scan.corner_count()) / glm::dot(normal, middle));
}

}  // namespace

ItemBuffer::ItemBuffer(std::uint32_t resolution) : resolution_(resolution) {
  MUST(resolution >= HemicubeBitmap::min_resolution && resolution <= HemicubeBitmap::max_resolution &&
       resolution % 2 == 0);
  items_.resize(pixel_count(resolution));
  inverse_depths_.resize(pixel_count(resolution));
  clear();
}

void ItemBuffer::clear() {
  std::fill(items_.begin(), items_.end(), no_item);
  std::fill(inverse_depths_.begin(), inverse_depths_.end(), 0.f);
}

void ItemBuffer::clear(const HemicubeBitmap& incoming) {
  MUST(incoming.resolution() == resolution_);
  for (std::uint32_t pixel = 0; pixel < items_.size(); ++pixel) {
    const bool covered = incoming.covered(pixel);
    items_[pixel] = covered ? nearer_cell : no_item;
    inverse_depths_[pixel] = covered ? std::numeric_limits<float>::infinity() : 0.f;  // nothing is nearer than that
  }
}

void ItemBuffer::project(const HemicubeFrame& frame, std::span<const Vec3> corners, std::uint32_t item) {
  AUDIT(item < nearer_cell);
  for_each_piece(corners, [&](std::span<const Vec3> piece) {
    PolygonScan scan;
    if (!scan.set_polygon(frame, piece)) return;
    const Vec3 gradient = inverse_depth_gradient(scan);
    const double step = 2.0 / resolution_;
    for (std::uint32_t face = 0; face < face_count; ++face) {
      if (!scan.set_face(face, resolution_)) continue;
      const Vec3 g = face_coordinates(face, gradient);
      const double lowest = face == 0 ? -1.0 : 0.0, per_column = g.x * step;
      scan.for_each_run([&](std::uint32_t row, std::uint32_t first, std::uint32_t end) {
        const double row_start = g.x * (0.5 * step - 1.0) + g.y * ((row + 0.5) * step + lowest) + g.z;
        const std::uint32_t row_pixel = first_pixel_of(face, resolution_) + row * resolution_;
        std::uint32_t* items = items_.data() + row_pixel;
        float* inverse_depths = inverse_depths_.data() + row_pixel;
        for (std::uint32_t column = first; column < end; ++column) {
          const auto inverse_depth = static_cast<float>(row_start + per_column * column);
          const bool nearer = inverse_depth > inverse_depths[column];
          items[column] = nearer ? item : items[column];
          inverse_depths[column] = nearer ? inverse_depth : inverse_depths[column];
        }
      });
    }
  });
}

bool ItemBuffer::sees(const HemicubeFrame& frame, const Vec3& point, std::uint32_t plane,
                      std::span<const std::uint32_t> plane_of_item) const {
  const Vec3 local = frame.to_local(point - frame.centre);
  if (!(local.z > 0.0)) return false;
  const std::uint32_t there = items_[pixel_of(local, resolution_)];
  if (there >= nearer_cell) return false;
  return (plane_of_item.empty() ? there : plane_of_item[there]) == plane;
}

void ItemBuffer::cover(HemicubeBitmap& bitmap) const {
  MUST(bitmap.resolution() == resolution_);
  for (std::uint32_t pixel = 0; pixel < items_.size(); ++pixel) {
    if (items_[pixel] != no_item) bitmap.cover(pixel);
  }
}

}  // namespace lichthof
