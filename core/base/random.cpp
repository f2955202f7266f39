#include "core/base/random.hpp"

#include <cmath>
#include <numbers>

namespace lichthof {

Vec3 cosine_direction(const Vec2& unit_square) {
  // Concentric map of Shirley and Chiu: it keeps strata compact, which polar coordinates do not.
  const double a = 2.0 * unit_square.x - 1.0;
  const double b = 2.0 * unit_square.y - 1.0;
  if (a == 0.0 && b == 0.0) return {0.0, 0.0, 1.0};
  double radius, angle;
  if (std::abs(a) > std::abs(b)) {
    radius = a;
    angle = (std::numbers::pi / 4) * (b / a);
  } else {
    radius = b;
    angle = std::numbers::pi / 2 - (std::numbers::pi / 4) * (a / b);
  }
  const double x = radius * std::cos(angle);
  const double y = radius * std::sin(angle);
  return {x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y))};
}

void complete_frame(const Vec3& normal, Vec3& tangent, Vec3& bitangent) {
  const double sign = std::copysign(1.0, normal.z);
  const double a = -1.0 / (sign + normal.z);
  const double b = normal.x * normal.y * a;
  tangent = {1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
  bitangent = {b, sign + normal.y * normal.y * a, -normal.y};
}

}  // namespace lichthof
