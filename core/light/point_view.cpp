#include "core/light/point_view.hpp"

#include <algorithm>
#include <cmath>

#include "core/light/form_factor.hpp"

namespace lichthof {

/// Whether one side of the pyramid has the whole piece outside.
bool PointView::misses(std::span<const Vec3> piece) const {
  return std::any_of(pyramid_.begin(), pyramid_.end(), [&](const Vec3& side) {
    return std::all_of(piece.begin(), piece.end(), [&](const Vec3& c) { return glm::dot(side, c) <= tolerance_; });
  });
}

/// Cuts a piece by a plane through the point into inside_ and outside_. @returns whether there is anything inside
bool PointView::split(std::span<const Vec3> piece, const Vec3& plane) {
  inside_.clear(), outside_.clear();
  bool some_inside = false, some_outside = false;
  const auto height_of = [&](const Vec3& c) {
    const double h = glm::dot(plane, c);
    return std::abs(h) <= tolerance_ ? 0.0 : h;
  };
  Vec3 previous = piece.back();
  double before = height_of(previous);
  for (const Vec3& corner : piece) {
    const double height = height_of(corner);
    if ((before > 0 && height < 0) || (before < 0 && height > 0)) {
      const Vec3 crossing = previous + (before / (before - height)) * (corner - previous);
      inside_.push_back(crossing), outside_.push_back(crossing);
    }
    if (height >= 0) inside_.push_back(corner);
    if (height <= 0) outside_.push_back(corner);
    some_inside |= height > 0, some_outside |= height < 0;
    previous = corner;
    before = height;
  }
  if (!some_outside || outside_.size() < 3) outside_.clear();
  return some_inside && inside_.size() >= 3;
}

/// Adds to next_ what of the piece lies outside the pyramid.
void PointView::cut(std::span<const Vec3> piece) {
  const std::size_t corners_before = next_.corners.size(), pieces_before = next_.ends.size();
  rest_.assign(piece.begin(), piece.end());
  for (const Vec3& side : pyramid_) {
    if (!split(rest_, side)) {
      // Nothing is in the shadow after all: the piece stays whole.
      next_.corners.resize(corners_before), next_.ends.resize(pieces_before);
      next_.add(piece);
      return;
    }
    if (!outside_.empty()) next_.add(outside_);
    rest_.swap(inside_);
  }
}

PointView::Factors PointView::factors(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
                                      std::span<const Obstruction> obstructions, std::span<const std::uint32_t> which) {
  now_.clear();
  rest_.clear();
  for (const Vec3& corner : source) rest_.push_back(corner - point);
  now_.add(rest_);
  Factors result;
  result.unobstructed = form_factor_at_origin(normal, now_.piece(0));
  for (const std::uint32_t index : which) {
    if (!shadow_sides(obstructions[index], point, tolerance_, pyramid_)) continue;
    std::size_t untouched = 0;
    while (untouched < now_.ends.size() && misses(now_.piece(untouched))) ++untouched;
    if (untouched == now_.ends.size()) continue;
    next_.clear();
    for (std::size_t k = 0; k < now_.ends.size(); ++k)
      if (k < untouched || misses(now_.piece(k)))
        next_.add(now_.piece(k));
      else
        cut(now_.piece(k));
    std::swap(now_, next_);
    if (now_.ends.empty()) return result;
  }
  for (std::size_t k = 0; k < now_.ends.size(); ++k) result.visible += form_factor_at_origin(normal, now_.piece(k));
  return result;
}

}  // namespace lichthof
