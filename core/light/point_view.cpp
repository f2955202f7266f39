#include "core/light/point_view.hpp"

#include <algorithm>
#include <cmath>

#include "core/light/form_factor.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof {

/// Coordinates in the source's plane, about its first corner.
void PointView::lay_plane(std::span<const Vec3> source) {
  along_u_ = glm::normalize(source[1] - source[0]);
  along_v_ = glm::normalize(glm::cross(newell_vector(source), along_u_));
  whole_.clear();
  for (const Vec3& corner : source) {
    const Vec3 d = corner - source[0];
    whole_.push_back({glm::dot(d, along_u_), glm::dot(d, along_v_)});
  }
}

/// The lines around the obstruction's shadow. @returns false when there is none on the source
bool PointView::find_shadow(const Obstruction& obstruction, const Vec3& point) {
  if (!shadow_sides(obstruction, point, tolerance_, sides_)) return false;
  shadow_.clear();
  for (const Vec3& side : sides_)
    shadow_.push_back({glm::dot(side, along_u_), glm::dot(side, along_v_), glm::dot(side, origin_)});
  return !misses(whole_);
}

/// Whether one of the shadow's lines has the whole piece outside.
bool PointView::misses(std::span<const Vec2> piece) const {
  for (const Line& line : shadow_) {
    double most = line.height(piece[0]);
    for (std::size_t k = 1; k < piece.size(); ++k) most = std::max(most, line.height(piece[k]));
    if (most <= tolerance_) return true;
  }
  return false;
}

/// Cuts a piece by a line into inside_ and outside_. @returns whether there is anything inside
bool PointView::split(std::span<const Vec2> piece, const Line& line) {
  inside_.clear(), outside_.clear(), heights_.clear();
  double least = 0, most = 0;
  for (const Vec2& corner : piece) {
    const double h = line.height(corner);
    heights_.push_back(std::abs(h) <= tolerance_ ? 0.0 : h);
    least = std::min(least, heights_.back()), most = std::max(most, heights_.back());
  }
  if (most == 0) return false;
  if (least == 0) {
    inside_.assign(piece.begin(), piece.end());
    return inside_.size() >= 3;
  }
  for (std::size_t k = 0, before = piece.size() - 1; k < piece.size(); before = k++) {
    const double height = heights_[k], previous = heights_[before];
    if ((previous > 0 && height < 0) || (previous < 0 && height > 0)) {
      const Vec2 crossing = piece[before] + (previous / (previous - height)) * (piece[k] - piece[before]);
      inside_.push_back(crossing), outside_.push_back(crossing);
    }
    if (height >= 0) inside_.push_back(piece[k]);
    if (height <= 0) outside_.push_back(piece[k]);
  }
  if (outside_.size() < 3) outside_.clear();
  return inside_.size() >= 3;
}

/// Adds to next_ what of the piece lies outside the shadow.
void PointView::cut(std::span<const Vec2> piece) {
  const std::size_t corners_before = next_.corners.size(), pieces_before = next_.ends.size();
  rest_.assign(piece.begin(), piece.end());
  for (const Line& line : shadow_) {
    if (!split(rest_, line)) {
      // Nothing is in the shadow after all: the piece stays whole.
      next_.corners.resize(corners_before), next_.ends.resize(pieces_before);
      next_.add(piece);
      return;
    }
    if (!outside_.empty()) next_.add(outside_);
    rest_.swap(inside_);
  }
}

/// The form factors of all pieces.
double PointView::seen(const Vec3& normal) {
  double sum = 0;
  for (std::size_t k = 0; k < now_.ends.size(); ++k) {
    seen_.clear();
    for (const Vec2& p : now_.piece(k)) seen_.push_back(origin_ + p.x * along_u_ + p.y * along_v_);
    sum += form_factor_at_origin(normal, seen_);
  }
  return sum;
}

PointView::Factors PointView::factors(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
                                      std::span<const Obstruction> obstructions, std::span<const std::uint32_t> which) {
  lay_plane(source);
  origin_ = source[0] - point;
  seen_.clear();
  for (const Vec3& corner : source) seen_.push_back(corner - point);
  const double unobstructed = form_factor_at_origin(normal, seen_);
  now_.clear();
  now_.add(whole_);
  bool shadowed = false;
  for (const std::uint32_t index : which) {
    if (!find_shadow(obstructions[index], point)) continue;
    std::size_t untouched = 0;
    while (untouched < now_.ends.size() && misses(now_.piece(untouched))) ++untouched;
    if (untouched == now_.ends.size()) continue;
    shadowed = true;
    next_.clear();
    for (std::size_t k = 0; k < now_.ends.size(); ++k)
      if (k < untouched || misses(now_.piece(k)))
        next_.add(now_.piece(k));
      else
        cut(now_.piece(k));
    std::swap(now_, next_);
    if (now_.ends.empty()) return {unobstructed, 0};
  }
  return {unobstructed, shadowed ? seen(normal) : unobstructed};
}

}  // namespace lichthof
