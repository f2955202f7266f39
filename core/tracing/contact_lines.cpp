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

SurfaceGrid::SurfaceGrid(const Scene& scene) : box_(bounds(scene)) {
  const Vec3 size = box_.size();
  const double longest = std::max({size.x, size.y, size.z, 1e-300});
  const double wanted = std::clamp(2.0 * std::cbrt(static_cast<double>(scene.surfaces.size())), 1.0, 64.0);
  for (int axis = 0; axis < 3; ++axis)
    count_[axis] = std::max(1, static_cast<int>(std::ceil(wanted * size[axis] / longest)));
  for (const Surface& surface : scene.surfaces) {
    Box box;
    for (const Vec3& corner : surface.corners) box.include(corner);
    boxes_.push_back(box);
  }
  // Two passes: count, then file.
  first_.assign(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2] + 1, 0);
  for (const bool filing : {false, true}) {
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t s = 0; s < boxes_.size(); ++s) {
      std::array<int, 3> lo, hi;
      range(boxes_[s], lo, hi);
      for (int z = lo[2]; z <= hi[2]; ++z)
        for (int y = lo[1]; y <= hi[1]; ++y)
          for (int x = lo[0]; x <= hi[0]; ++x) {
            if (filing)
              surfaces_[next[cell({x, y, z})]++] = s;
            else
              ++first_[cell({x, y, z}) + 1];
          }
    }
    if (!filing) {
      for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
      surfaces_.resize(first_.back());
    }
  }
}

void SurfaceGrid::range(const Box& box, std::array<int, 3>& first, std::array<int, 3>& last) const {
  const Vec3 size = box_.size();
  for (int axis = 0; axis < 3; ++axis) {
    const double scale = size[axis] > 0 ? count_[axis] / size[axis] : 0.0;
    const auto index = [&](double coordinate) {
      return static_cast<int>(std::clamp(std::floor((coordinate - box_.lo[axis]) * scale), 0.0, count_[axis] - 1.0));
    };
    first[axis] = index(box.lo[axis]);
    last[axis] = index(box.hi[axis]);
  }
}

std::vector<std::uint32_t> SurfaceGrid::near(const Box& box) const {
  std::vector<std::uint32_t> found;
  std::array<int, 3> lo, hi;
  range(box, lo, hi);
  for (int z = lo[2]; z <= hi[2]; ++z)
    for (int y = lo[1]; y <= hi[1]; ++y)
      for (int x = lo[0]; x <= hi[0]; ++x) {
        const std::size_t c = cell({x, y, z});
        for (std::uint32_t i = first_[c]; i < first_[c + 1]; ++i) {
          const Box& other = boxes_[surfaces_[i]];
          bool apart = false;
          for (int axis = 0; axis < 3; ++axis) apart |= other.lo[axis] > box.hi[axis] || other.hi[axis] < box.lo[axis];
          if (!apart) found.push_back(surfaces_[i]);
        }
      }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

std::vector<ContactLine> contact_lines(const Scene& scene, const SurfaceGrid& grid, const Plane& plane, const Vec2& lo,
                                       const Vec2& hi, double lift) {
  Box box;
  for (const Vec2& corner : {lo, hi, Vec2{lo.x, hi.y}, Vec2{hi.x, lo.y}})
    box.include(plane.point(corner) + lift * plane.normal);
  box.lo -= Vec3{lift}, box.hi += Vec3{lift};

  std::vector<ContactLine> lines;
  for (const std::uint32_t s : grid.near(box)) {
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
