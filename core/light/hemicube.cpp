#include "core/light/hemicube.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"

namespace lichthof {
namespace {

struct PixelPlace {
  std::uint32_t face, column, row;
};

PixelPlace place_of(std::uint32_t pixel, std::uint32_t resolution) {
  AUDIT(pixel < pixel_count(resolution));
  const std::uint32_t half_face = resolution * resolution / 2;
  const std::uint32_t face = pixel < 2 * half_face ? 0 : pixel / half_face - 1;
  const std::uint32_t within = pixel - first_pixel_of(face, resolution);
  return {face, within % resolution, within / resolution};
}

/// Centre of a pixel in its face's coordinates (a, b).
Vec2 centre_of(const PixelPlace& place, std::uint32_t resolution) {
  const double step = 2.0 / resolution;
  return {(place.column + 0.5) * step - 1.0, (place.row + 0.5) * step - (place.face == 0 ? 1.0 : 0.0)};
}

/// Index of the pixel that a coordinate falls into; not-a-number goes to 0.
std::uint32_t index_in(double position, std::uint32_t count) {
  return static_cast<std::uint32_t>(std::min(std::max(0.0, position), count - 1.0));
}

}  // namespace

Vec3 pixel_direction(std::uint32_t pixel, std::uint32_t resolution) {
  const PixelPlace place = place_of(pixel, resolution);
  const Vec2 p = centre_of(place, resolution);
  switch (place.face) {
    case 0:
      return {p.x, p.y, 1.0};
    case 1:
      return {1.0, p.x, p.y};
    case 2:
      return {-p.x, 1.0, p.y};
    case 3:
      return {-1.0, -p.x, p.y};
    default:
      return {p.x, -1.0, p.y};
  }
}

std::uint32_t pixel_of(const Vec3& local_direction, std::uint32_t resolution) {
  const double x = std::abs(local_direction.x), y = std::abs(local_direction.y);
  std::uint32_t face = 0;
  if (local_direction.z < std::max(x, y)) {
    face = x >= y ? (local_direction.x > 0 ? 1 : 3) : (local_direction.y > 0 ? 2 : 4);
  }
  const Vec3 p = face_coordinates(face, local_direction);
  const double half = 0.5 * resolution;
  const std::uint32_t column = index_in((p.x / p.z + 1.0) * half, resolution);
  const std::uint32_t row = index_in((p.y / p.z + (face == 0 ? 1.0 : 0.0)) * half, face_rows(face, resolution));
  return first_pixel_of(face, resolution) + row * resolution + column;
}

double delta_form_factor(std::uint32_t pixel, std::uint32_t resolution) {
  const PixelPlace place = place_of(pixel, resolution);
  const Vec2 p = centre_of(place, resolution);
  const double r2 = p.x * p.x + p.y * p.y + 1.0;
  const double pixel_area = 4.0 / (static_cast<double>(resolution) * resolution);
  return (place.face == 0 ? 1.0 : p.y) * pixel_area / (std::numbers::pi * r2 * r2);
}

}  // namespace lichthof
