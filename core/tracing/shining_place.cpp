#include "core/tracing/shining_place.hpp"

#include <algorithm>
#include <cmath>

#include "core/scene/polygon.hpp"

namespace lichthof {

Vec3 shining_place(std::span<const Vec3> corners, double area, const Vec3& emitting_normal, const Vec3& point,
                   const Vec3& normal, const Vec3& fallback, Random& random) {
  constexpr int most_tries = 64;
  // On one plane the cosine at the luminaire is the plane's distance over d: height / d⁴ is left to weigh by. Uniform places are
  // rejected by it, against a bound from the corners. Where all are, which a bound far above most places makes likely, one of
  // them is drawn by its weight.
  const double plane_distance = -glm::dot(emitting_normal, corners[0] - point);
  double highest = 0, reach2 = 0;
  for (const Vec3& corner : corners) {
    const Vec3 across = corner - corners[0];
    highest = std::max(highest, glm::dot(normal, corner - point));
    reach2 = std::max(reach2, glm::dot(across, across));
  }
  const double nearest = std::max(plane_distance, glm::length(corners[0] - point) - std::sqrt(reach2));
  const double most = highest / (nearest * nearest * nearest * nearest);
  Vec3 drawn = fallback;
  double sum = 0;
  for (int i = 0; i < most_tries; ++i) {
    const Vec3 place = random_place(corners, area, random), way = place - point;
    const double d2 = glm::dot(way, way), weight = std::max(0.0, glm::dot(normal, way)) / (d2 * d2);
    if (random.unit() * most < weight) return place;
    sum += weight;
    if (random.unit() * sum < weight) drawn = place;
  }
  return drawn;
}

}  // namespace lichthof
