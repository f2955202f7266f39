/// Rays against polygons the slow way, in extended precision: what the projectors are measured by.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "core/base/random.hpp"
#include "core/light/hemicube.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof::reference {

using Real = long double;
using Real3 = glm::vec<3, Real>;

/// A polygon in the hemicube's local frame, ready to be met by pixel rays.
struct LocalPolygon {
  std::vector<Real3> corners;
  Real3 normal{0};  // not unit
  Real3 middle{0};

  LocalPolygon(const HemicubeFrame& frame, std::span<const Vec3> world) {
    for (const Vec3& p : world) {
      const Real3 d = Real3(p) - Real3(frame.centre);
      corners.emplace_back(glm::dot(d, Real3(frame.tangent)), glm::dot(d, Real3(frame.bitangent)),
                           glm::dot(d, Real3(frame.normal)));
    }
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      normal += glm::cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
    }
    for (const Real3& p : corners) middle += p / static_cast<Real>(corners.size());
  }

  struct Meeting {
    bool inside = false;
    bool undecided = false;  // the ray passes nearer than 1e-9 (as an angle) to the line of an edge
    Real t = 0;              // the ray's length up to the polygon's plane
  };

  /// Where the ray t · direction, t > 0, meets the polygon.
  Meeting meeting(const Vec3& direction) const {
    const Real3 d(direction);
    Meeting result;
    const Real towards = glm::dot(normal, d);
    if (towards == 0) return result;
    result.t = glm::dot(normal, middle) / towards;
    bool inside = false;
    // Crossings of a half line in the plane of the two coordinates where the polygon is largest.
    const Real3 size = glm::abs(normal);
    const int drop = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const int u = (drop + 1) % 3, v = (drop + 2) % 3;
    const Real3 x = result.t * d;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Real3& p = corners[i];
      const Real3& q = corners[(i + 1) % corners.size()];
      if ((p[v] > x[v]) != (q[v] > x[v]) && x[u] < p[u] + (q[u] - p[u]) * (x[v] - p[v]) / (q[v] - p[v]))
        inside = !inside;
      const Real3 edge = glm::cross(p, q);
      const Real length = glm::length(edge);
      if (length > 0 && std::abs(glm::dot(edge, d)) < 1e-9L * length * glm::length(d)) result.undecided = true;
    }
    result.inside = inside && result.t > 0;
    return result;
  }
};

inline Vec3 random_unit(Random& random) {
  for (;;) {
    const Vec3 v{2 * random.unit() - 1, 2 * random.unit() - 1, 2 * random.unit() - 1};
    const double length = glm::length(v);
    if (length > 0.1 && length < 1.0) return v / length;
  }
}

inline HemicubeFrame random_frame(Random& random, const Vec3& centre) {
  HemicubeFrame frame;
  frame.centre = centre;
  frame.normal = random_unit(random);
  complete_frame(frame.normal, frame.tangent, frame.bitangent);
  return frame;
}

/// The frame whose local axes are the world's.
inline HemicubeFrame upright_frame(const Vec3& centre) { return {centre, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; }

/// Corners of an ellipse at increasing angles: a convex polygon, `thickness` 1 for round and near 0 for slivers.
inline Polygon random_polygon(Random& random, const Vec3& centre, double size, double thickness) {
  const std::uint32_t count = 3 + random.below(6);
  const Vec3 normal = random_unit(random);
  Vec3 u, v;
  complete_frame(normal, u, v);
  Polygon polygon;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double angle = 6.283185307179586 * (i + 0.8 * random.unit()) / count;
    polygon.push_back(centre + size * (std::cos(angle) * u + thickness * std::sin(angle) * v));
  }
  return polygon;
}

/// Whether the segment a-b passes the polygon, in double precision: > 0 inside by so much, < 0 outside (m).
inline double inside_by(const Vec3& a, const Vec3& b, const Polygon& polygon) {
  const Vec3 n = glm::normalize(newell_vector(polygon));
  const double ha = glm::dot(n, a - polygon[0]), hb = glm::dot(n, b - polygon[0]);
  if ((ha > 0) == (hb > 0)) return -std::min(std::abs(ha), std::abs(hb));
  const Vec3 p = a + ha / (ha - hb) * (b - a);
  double nearest = 1e9;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 edge = polygon[(k + 1) % polygon.size()] - polygon[k];
    nearest = std::min(nearest, glm::dot(glm::cross(n, glm::normalize(edge)), p - polygon[k]));
  }
  return nearest;
}

}  // namespace lichthof::reference
