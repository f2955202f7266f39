#include "core/light/view_shaft.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

Obstruction obstruction(Polygon corners, const Vec3& normal) {
  Obstruction result;
  for (const Vec3& corner : corners) result.box.include(corner);
  result.planes.push_back({normal, glm::dot(normal, corners.front())});
  result.corners = std::move(corners);
  return result;
}

namespace {

void add_side(const Vec3& along, const Vec3& to_edge, std::vector<Vec3>& sides) {
  const Vec3 side = glm::cross(along, to_edge);
  // An edge that is seen end on bounds nothing.
  if (const double length = glm::length(side); length > 0) sides.push_back(side / length);
}

}  // namespace

bool shadow_sides(const Obstruction& o, const Vec3& point, double tolerance, std::vector<Vec3>& sides) {
  sides.clear();
  if (!o.is_solid()) {
    const double height = o.planes.front().height(point);
    if (std::abs(height) <= tolerance) return false;
    for_each_edge(o, [&](const Vec3& from, const Vec3& to) {
      add_side(height > 0 ? to - from : from - to, from - point, sides);
    });
    return true;
  }
  // The silhouette: edges between a plane that is seen from outside and one that is not.
  std::uint64_t seen = 0;
  for (std::size_t k = 0; k < o.planes.size(); ++k)
    if (o.planes[k].height(point) > tolerance) seen |= std::uint64_t{1} << k;
  if (seen == 0) return false;
  for (const Obstruction::Rim& rim : o.rims) {
    const bool left = seen >> rim.left & 1, right = seen >> rim.right & 1;
    // The plane on the left has the edge counter-clockwise, as a polygon that is seen from its front would have it.
    if (left != right) add_side(left ? rim.to - rim.from : rim.from - rim.to, rim.from - point, sides);
  }
  return true;
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
  // A plane that has both polygons on one side cuts no line of sight, nor anything behind it.
  for (const Obstruction::Plane& plane : o.planes) {
    double least = 0, most = 0;
    for (const std::span<const Vec3> polygon : {first_, second_})
      for (const Vec3& p : polygon) least = std::min(least, plane.height(p)), most = std::max(most, plane.height(p));
    if (least >= -tolerance_ || (most <= tolerance_ && !o.is_solid())) return false;
  }
  return std::none_of(sides_.begin(), sides_.end(), [&](const Side& side) {
    return std::all_of(o.corners.begin(), o.corners.end(),
                       [&](const Vec3& p) { return glm::dot(side.normal, p) - side.offset >= -tolerance_; });
  });
}

namespace {

/// Whether all of `first` is on one side of a polygon and, where `second` is given, all of that on the other.
bool divides(const Obstruction::Plane& plane, std::span<const Vec3> first, std::span<const Vec3> second,
             double tolerance) {
  double least = 1e300, most = -1e300;
  for (const Vec3& p : first) least = std::min(least, plane.height(p)), most = std::max(most, plane.height(p));
  const bool above = least > tolerance;
  if (!above && most >= -tolerance) return false;
  return std::none_of(second.begin(), second.end(), [&](const Vec3& p) {
    return above ? plane.height(p) > tolerance : plane.height(p) < -tolerance;
  });
}

/// The planes between which what the obstruction hides from all of `first` lies. @returns false: it hides nothing from all
bool umbra_of(const Obstruction& o, std::span<const Vec3> first, double tolerance,
              std::vector<Obstruction::Plane>& planes, std::vector<Vec3>& sides) {
  planes.clear();
  if (!o.is_solid() && !divides(o.planes.front(), first, {}, tolerance)) return false;
  for (const Vec3& eye : first) {
    if (!shadow_sides(o, eye, tolerance, sides)) return false;
    for (const Vec3& side : sides) planes.push_back({side, glm::dot(side, eye)});
  }
  return true;
}

}  // namespace

bool hides_all(const Obstruction& o, std::span<const Vec3> first, std::span<const Vec3> second, double tolerance) {
  if (!o.is_solid() && !divides(o.planes.front(), first, second, tolerance)) return false;
  // Every line of sight between corners crosses it.
  std::vector<Vec3> sides;
  for (const Vec3& eye : first) {
    if (!shadow_sides(o, eye, tolerance, sides)) return false;
    for (const Vec3& side : sides)
      for (const Vec3& p : second)
        if (glm::dot(side, p - eye) < -tolerance) return false;
  }
  return true;
}

std::vector<Polygon> outside_umbrae(std::span<const Obstruction> obstructions, std::span<const std::uint32_t> which,
                                    std::span<const Vec3> first, std::span<const Vec3> second, double tolerance) {
  constexpr std::size_t most_pieces = 64;  // beyond, what is left is not cut any smaller
  std::vector<Polygon> pieces{Polygon(second.begin(), second.end())};
  std::vector<Obstruction::Plane> umbra;
  std::vector<Vec3> sides;
  for (const std::uint32_t index : which) {
    if (pieces.empty() || pieces.size() > most_pieces) break;
    if (!umbra_of(obstructions[index], first, tolerance, umbra, sides)) continue;
    std::vector<Polygon> left;
    for (const Polygon& piece : pieces) {
      const std::size_t before = left.size();
      Polygon rest = piece;
      for (const Obstruction::Plane& plane : umbra) {
        Polygon outside = clipped(rest, -plane.normal, -plane.offset, tolerance);
        if (!outside.empty()) left.push_back(std::move(outside));
        rest = clipped(rest, plane.normal, plane.offset, tolerance);
        if (!rest.empty()) continue;
        // Nothing is in the umbra after all: the piece stays whole.
        left.resize(before);
        left.push_back(piece);
        break;
      }
    }
    pieces = std::move(left);
  }
  return pieces;
}

}  // namespace lichthof
