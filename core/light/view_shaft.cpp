#include "core/light/view_shaft.hpp"

#include <algorithm>

namespace lichthof {

Obstruction obstruction(Polygon corners, const Vec3& normal) {
  Obstruction result;
  for (const Vec3& corner : corners) result.box.include(corner);
  result.normal = normal;
  result.offset = glm::dot(normal, corners.front());
  result.corners = std::move(corners);
  return result;
}

ViewShaft::ViewShaft(std::span<const Vec3> first, std::span<const Vec3> second, double tolerance)
    : first_(first), second_(second), tolerance_(tolerance) {
  for (const Vec3& p : first) box_.include(p);
  for (const Vec3& p : second) box_.include(p);
  sides_.reserve(first.size() + second.size());
  add_planes(first, second);
  add_planes(second, first);
}

void ViewShaft::add_planes(std::span<const Vec3> edges, std::span<const Vec3> points) {
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const Vec3 &from = edges[k], &to = edges[k + 1 < edges.size() ? k + 1 : 0];
    for (const Vec3& point : points) {
      Vec3 normal = glm::cross(to - from, point - from);
      const double length = glm::length(normal);
      // A corner on the edge's own line spans no plane.
      if (length <= tolerance_ * glm::length(to - from)) continue;
      normal /= length;
      const double offset = glm::dot(normal, from);
      double least = 0, most = 0;
      for (const std::span<const Vec3> polygon : {edges, points})
        for (const Vec3& p : polygon) {
          const double height = glm::dot(normal, p) - offset;
          least = std::min(least, height), most = std::max(most, height);
        }
      // Only a plane with the whole hull on one side is a side of it.
      if (most <= 1e-3 * tolerance_)
        sides_.push_back({normal, offset + most});
      else if (least >= -1e-3 * tolerance_)
        sides_.push_back({-normal, -(offset + least)});
    }
  }
}

bool ViewShaft::may_hold(const Obstruction& o) const {
  for (int axis = 0; axis < 3; ++axis)
    if (o.box.lo[axis] >= box_.hi[axis] || o.box.hi[axis] <= box_.lo[axis]) return false;
  // A plane that has both polygons on one side cuts no line of sight.
  double least = 0, most = 0;
  for (const std::span<const Vec3> polygon : {first_, second_})
    for (const Vec3& p : polygon) least = std::min(least, o.height(p)), most = std::max(most, o.height(p));
  if (least >= -tolerance_ || most <= tolerance_) return false;
  return std::none_of(sides_.begin(), sides_.end(), [&](const Side& side) {
    return std::all_of(o.corners.begin(), o.corners.end(),
                       [&](const Vec3& p) { return glm::dot(side.normal, p) - side.offset >= -tolerance_; });
  });
}

bool hides_all(const Obstruction& o, std::span<const Vec3> first, std::span<const Vec3> second, double tolerance) {
  // One polygon on each side of the plane.
  double least = 1e300, most = -1e300;
  for (const Vec3& p : first) least = std::min(least, o.height(p)), most = std::max(most, o.height(p));
  const bool above = least > tolerance;
  if (!above && most >= -tolerance) return false;
  for (const Vec3& p : second)
    if (above ? o.height(p) > tolerance : o.height(p) < -tolerance) return false;
  // Every line of sight between corners crosses the polygon.
  for (const Vec3& eye : first)
    for (std::size_t k = 0; k < o.corners.size(); ++k) {
      const Vec3 a = o.corners[k] - eye, b = o.corners[k + 1 < o.corners.size() ? k + 1 : 0] - eye;
      Vec3 inwards = above ? glm::cross(b, a) : glm::cross(a, b);
      inwards /= std::max(glm::length(inwards), 1e-300);
      for (const Vec3& p : second)
        if (glm::dot(inwards, p - eye) < -tolerance) return false;
    }
  return true;
}

}  // namespace lichthof
