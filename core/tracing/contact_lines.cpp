#include "core/tracing/contact_lines.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

namespace {
double cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }
}  // namespace

bool separates(const ContactLine& line, const Vec2& point, const Vec2& centre, double tolerance) {
  const Vec2 along = line.b - line.a;
  const double slack = tolerance * std::sqrt(along.x * along.x + along.y * along.y);
  const double of_point = cross(along, point - line.a), of_centre = cross(along, centre - line.a);
  if (std::abs(of_point) <= slack) return false;
  const bool centre_on_line = std::abs(of_centre) <= slack;
  if (!centre_on_line && (of_point > 0) == (of_centre > 0)) return false;
  const Vec2 way = centre - point;
  return cross(way, line.a - point) * cross(way, line.b - point) <= 0;
}

bool touches(const ContactLine& line, const Vec2& lo, const Vec2& hi) {
  // Clip the parameter range of a + t (b - a) by both slabs.
  double first = 0, last = 1;
  const Vec2 way = line.b - line.a;
  for (int axis = 0; axis < 2; ++axis) {
    if (way[axis] == 0) {
      if (line.a[axis] < lo[axis] || line.a[axis] > hi[axis]) return false;
      continue;
    }
    double enter = (lo[axis] - line.a[axis]) / way[axis], leave = (hi[axis] - line.a[axis]) / way[axis];
    if (enter > leave) std::swap(enter, leave);
    first = std::max(first, enter);
    last = std::min(last, leave);
  }
  return first <= last;
}

std::vector<ContactLine> contact_lines(const Scene& scene, const SurfaceBoxes& boxes, const Plane& plane,
                                       const Vec2& lo, const Vec2& hi, double lift) {
  Box box;
  for (const Vec2& corner : {lo, hi, Vec2{lo.x, hi.y}, Vec2{hi.x, lo.y}})
    box.include(plane.point(corner) + lift * plane.normal);
  box.lo -= Vec3{lift}, box.hi += Vec3{lift};

  std::vector<ContactLine> lines;
  for (const std::uint32_t s : boxes.near(box)) {
    const Surface& surface = scene.surfaces[s];
    if (scene.material_of(surface).finish == Finish::glass) continue;
    // The section of a convex polygon with a plane is one line: between the two edges that change sides.
    Vec2 end[2];
    int ends = 0;
    double previous = glm::dot(surface.corners.back() - plane.origin, plane.normal) - lift;
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      const Vec3& from = surface.corners[k == 0 ? surface.corners.size() - 1 : k - 1];
      const double height = glm::dot(surface.corners[k] - plane.origin, plane.normal) - lift;
      if ((previous > 0) != (height > 0) && ends < 2) {
        const double t = previous / (previous - height);
        end[ends++] = plane.coordinates(from + t * (surface.corners[k] - from));
      }
      previous = height;
    }
    if (ends == 2 && touches({end[0], end[1]}, lo, hi)) lines.push_back({end[0], end[1]});
  }
  return lines;
}

}  // namespace lichthof
