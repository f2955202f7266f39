#include "core/light/form_factor.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

/// Corners relative to the point, cut at the receiver's horizon. Fixed storage: clipping adds at most one corner.
struct VisiblePart {
  static constexpr std::size_t capacity = 40;
  std::array<Vec3, capacity> corner;
  std::size_t count = 0;
};

VisiblePart above_horizon(const Vec3& point, const Vec3& normal, std::span<const Vec3> corners) {
  MUST(corners.size() < VisiblePart::capacity);
  VisiblePart part;
  Vec3 previous = corners.back() - point;
  double previous_height = glm::dot(previous, normal);
  for (const Vec3& c : corners) {
    const Vec3 current = c - point;
    const double height = glm::dot(current, normal);
    if ((previous_height > 0) != (height > 0)) {
      const double t = previous_height / (previous_height - height);
      part.corner[part.count++] = previous + t * (current - previous);
    }
    if (height > 0) part.corner[part.count++] = current;
    previous = current;
    previous_height = height;
  }
  return part;
}

}  // namespace

double form_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> corners) {
  const VisiblePart part = above_horizon(point, normal, corners);
  if (part.count < 3) return 0.0;
  // A receiver behind the shooter's plane gets nothing, whatever the winding of the sum says.
  const Vec3 shooter_normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  if (glm::dot(shooter_normal, point - corners[0]) <= 0) return 0.0;

  return form_factor_at_origin(normal, {part.corner.data(), part.count});
}

double form_factor_at_origin(const Vec3& normal, std::span<const Vec3> corners) {
  double sum = 0.0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3& a = corners[k];
    const Vec3& b = corners[k + 1 < corners.size() ? k + 1 : 0];
    // b × a written with the edge b - a: no cancellation when the polygon is small and far.
    const Vec3 across = glm::cross(b - a, a);
    const double sine = glm::length(across);
    if (sine == 0.0) continue;
    sum += std::atan2(sine, glm::dot(a, b)) / sine * glm::dot(normal, across);
  }
  return std::max(0.0, sum / (2.0 * std::numbers::pi));
}

bool visible_point(const Vec3& point, const Vec3& normal, std::span<const Vec3> corners, Vec3& target) {
  const VisiblePart part = above_horizon(point, normal, corners);
  if (part.count < 3) return false;
  Vec3 sum{0.0};
  for (std::size_t k = 0; k < part.count; ++k) sum += part.corner[k];
  target = point + sum / static_cast<double>(part.count);
  return true;
}

}  // namespace lichthof
