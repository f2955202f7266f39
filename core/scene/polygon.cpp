#include "core/scene/polygon.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

Vec3 random_place(std::span<const Vec3> corners, double area, Random& random) {
  double pick = random.unit() * area;
  const double s = std::sqrt(random.unit()), t = random.unit();
  for (std::size_t k = 2; k + 1 < corners.size(); ++k) {
    const double piece = 0.5 * glm::length(glm::cross(corners[k - 1] - corners[0], corners[k] - corners[0]));
    if (pick <= piece) return corners[0] + s * ((1 - t) * (corners[k - 1] - corners[0]) + t * (corners[k] - corners[0]));
    pick -= piece;
  }
  const std::size_t last = corners.size() - 1;
  return corners[0] + s * ((1 - t) * (corners[last - 1] - corners[0]) + t * (corners[last] - corners[0]));
}

Vec2 place_in(std::span<const Vec2> corners, double area, const Vec2& square) {
  double pick = square.x * area;
  for (std::size_t k = 2; k < corners.size(); ++k) {
    const Vec2 a = corners[k - 1] - corners[0], b = corners[k] - corners[0];
    const double part = 0.5 * (a.x * b.y - a.y * b.x);
    if (pick <= part || k + 1 == corners.size()) {
      const double s = part > 0 ? std::sqrt(std::clamp(pick / part, 0.0, 1.0)) : 0.0;
      return corners[0] + s * ((1 - square.y) * a + square.y * b);
    }
    pick -= part;
  }
  return corners[0];
}

Vec3 newell_vector(std::span<const Vec3> corners) {
  // Relative to the first corner, so that polygons far from the origin lose no digits.
  Vec3 sum{0.0};
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    sum += glm::cross(corners[k] - corners[0], corners[k + 1] - corners[0]);
  return sum;
}

double area(std::span<const Vec3> corners) { return 0.5 * glm::length(newell_vector(corners)); }

double signed_area(std::span<const Vec2> corners) {
  double sum = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Vec2 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    sum += a.x * b.y - a.y * b.x;
  }
  return 0.5 * sum;
}

Vec3 centroid(std::span<const Vec3> corners) {
  const Vec3 normal = newell_vector(corners);
  Vec3 sum{0.0};
  double weight = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Vec3 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    const double w = glm::dot(glm::cross(a, b), normal);
    sum += w * (a + b);
    weight += w;
  }
  return corners[0] + sum / (3.0 * weight);
}

Vec2 centroid(std::span<const Vec2> corners) {
  Vec2 sum{0.0};
  double weight = 0;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Vec2 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    const double w = a.x * b.y - a.y * b.x;
    sum += w * (a + b);
    weight += w;
  }
  return corners[0] + sum / (3.0 * weight);
}

double flatness_defect(std::span<const Vec3> corners) {
  const Vec3 n = newell_vector(corners);
  const double length = glm::length(n);
  if (length == 0) return 0;
  Vec3 middle{0.0};
  for (const Vec3& c : corners) middle += (c - corners[0]) / static_cast<double>(corners.size());
  double worst = 0;
  for (const Vec3& c : corners) worst = std::max(worst, std::abs(glm::dot(c - corners[0] - middle, n)) / length);
  return worst;
}

bool is_convex(std::span<const Vec3> corners) {
  const Vec3 n = newell_vector(corners);
  const std::size_t count = corners.size();
  double turned = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 in = corners[(k + 1) % count] - corners[k];
    const Vec3 out = corners[(k + 2) % count] - corners[(k + 1) % count];
    const double left = glm::dot(glm::cross(in, out), n);
    const double scale = glm::length(in) * glm::length(out) * glm::length(n);
    if (left < -1e-9 * scale) return false;
    turned += std::atan2(left, glm::dot(in, out) * glm::length(n));
  }
  return turned < 1.5 * 2 * 3.14159265358979;  // a star polygon turns left everywhere too, but twice round
}

namespace {

/// Sutherland-Hodgman against one line; the crossing is computed from the inner end outwards whichever way the edge runs,
/// so that two polygons sharing the edge get the same corner bit for bit.
template <class P>
std::vector<P> clipped_by(std::span<const P> corners, const P& normal, double offset, double tolerance) {
  std::vector<P> kept;
  kept.reserve(corners.size() + 1);
  bool beyond = false;
  const auto height_of = [&](const P& p) {
    const double h = glm::dot(normal, p) - offset;
    return std::abs(h) <= tolerance ? 0.0 : h;
  };
  P previous = corners.back();
  double previous_height = height_of(previous);
  for (const P& current : corners) {
    const double height = height_of(current);
    if ((previous_height > 0 && height < 0) || (previous_height < 0 && height > 0)) {
      const P& inner = height > 0 ? current : previous;
      const P& outer = height > 0 ? previous : current;
      const double inner_height = std::max(height, previous_height);
      const double outer_height = std::min(height, previous_height);
      kept.push_back(inner + (inner_height / (inner_height - outer_height)) * (outer - inner));
    }
    if (height >= 0) kept.push_back(current);
    beyond |= height > 0;
    previous = current;
    previous_height = height;
  }
  if (!beyond || kept.size() < 3) kept.clear();
  return kept;
}

}  // namespace

Polygon clipped(std::span<const Vec3> corners, const Vec3& normal, double offset, double tolerance) {
  return clipped_by(corners, normal, offset, tolerance);
}
Polygon2 clipped(std::span<const Vec2> corners, const Vec2& normal, double offset, double tolerance) {
  return clipped_by(corners, normal, offset, tolerance);
}

}  // namespace lichthof
