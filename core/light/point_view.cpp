#include "core/light/point_view.hpp"

#include <algorithm>
#include <cmath>

#include "core/light/form_factor.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof {

void PointView::Pieces::add(std::span<const Vec2> corners_of_piece, Piece known) {
  known.first = static_cast<std::uint32_t>(corners.size());
  corners.insert(corners.end(), corners_of_piece.begin(), corners_of_piece.end());
  all.push_back(known);
}

void PointView::Pieces::add(std::span<const Vec2> corners_of_piece) {
  Piece piece;
  piece.count = static_cast<std::uint32_t>(corners_of_piece.size());
  for (const Vec2& p : corners_of_piece) piece.middle += p;
  piece.middle /= static_cast<double>(piece.count);
  double square = 0;
  for (const Vec2& p : corners_of_piece) square = std::max(square, glm::dot(p - piece.middle, p - piece.middle));
  piece.radius = std::sqrt(square);
  add(corners_of_piece, piece);
}

/// Coordinates in the source's plane, about its first corner.
void PointView::lay_plane(std::span<const Vec3> source) {
  along_u_ = glm::normalize(source[1] - source[0]);
  along_v_ = glm::normalize(glm::cross(newell_vector(source), along_u_));
  rest_.clear(source.size());
  for (const Vec3& corner : source) {
    const Vec3 d = corner - source[0];
    rest_.push({glm::dot(d, along_u_), glm::dot(d, along_v_)});
  }
  whole_.clear();
  whole_.add(rest_.corners());
}

/// The cone in which the point sees the source, whose corners lie relative to the point in seen_.
void PointView::find_cone() {
  cone_.clear();
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    const Vec3 &from = seen_[k], &to = seen_[k + 1 < seen_.size() ? k + 1 : 0];
    const Vec3 outwards = glm::cross(from, to - from);
    if (const double length = glm::length(outwards); length > 0) cone_.push_back(outwards / length);
  }
}

/// Whether one side of the cone has the whole obstruction outside: first its box, then its corners.
bool PointView::is_beside(const Obstruction& obstruction, const Vec3& point) const {
  const Vec3 middle = obstruction.box.centre() - point, half = 0.5 * obstruction.box.size();
  return std::any_of(cone_.begin(), cone_.end(), [&](const Vec3& side) {
    const double height = glm::dot(side, middle);
    if (height <= -tolerance_) return false;
    if (height - glm::dot(glm::abs(side), half) >= -tolerance_) return true;
    return std::all_of(obstruction.corners.begin(), obstruction.corners.end(),
                       [&](const Vec3& p) { return glm::dot(side, p - point) >= -tolerance_; });
  });
}

/// The lines around the obstruction's shadow. @returns false when there is none on the source
bool PointView::find_shadow(const Obstruction& obstruction, const Vec3& point) {
  if (!shadow_sides(obstruction, point, tolerance_, sides_)) return false;
  shadow_.clear();
  for (const Vec3& side : sides_) {
    const double u = glm::dot(side, along_u_), v = glm::dot(side, along_v_);
    shadow_.push_back({u, v, glm::dot(side, origin_), std::sqrt(u * u + v * v)});
  }
  return !misses(whole_, whole_.all[0]);
}

/// Whether one of the shadow's lines has the whole piece outside.
bool PointView::misses(const Pieces& pieces, const Piece& piece) const {
  for (const Line& line : shadow_) {
    const double middle = line.height(piece.middle), reach = line.slope * piece.radius;
    if (middle > tolerance_) continue;
    if (middle + reach <= tolerance_) return true;
    double most = middle;
    for (const Vec2& p : pieces.corners_of(piece)) most = std::max(most, line.height(p));
    if (most <= tolerance_) return true;
  }
  return false;
}

/// Cuts rest_ by a line into inside_ and outside_. @returns whether there is anything inside
bool PointView::split(const Line& line) {
  // Convex: a line crosses it twice, and a corner that rounding has bent in once more.
  const std::size_t most_corners = 2 * rest_.count + 2;
  inside_.clear(most_corners), outside_.clear(most_corners);
  if (heights_.size() < rest_.count) heights_.resize(rest_.count);
  double least = 0, most = 0;
  for (std::size_t k = 0; k < rest_.count; ++k) {
    const double h = line.height(rest_.corner[k]);
    heights_[k] = std::abs(h) <= tolerance_ ? 0.0 : h;
    least = std::min(least, heights_[k]), most = std::max(most, heights_[k]);
  }
  if (most == 0) return false;
  if (least == 0) return true;
  for (std::size_t k = 0, before = rest_.count - 1; k < rest_.count; before = k++) {
    const double height = heights_[k], previous = heights_[before];
    if ((previous > 0 && height < 0) || (previous < 0 && height > 0)) {
      const Vec2 crossing =
          rest_.corner[before] + (previous / (previous - height)) * (rest_.corner[k] - rest_.corner[before]);
      inside_.push(crossing), outside_.push(crossing);
    }
    if (height >= 0) inside_.push(rest_.corner[k]);
    if (height <= 0) outside_.push(rest_.corner[k]);
  }
  if (outside_.count < 3) outside_.count = 0;
  return inside_.count >= 3;
}

/// Adds to next_ what of a piece of now_ lies outside the shadow.
void PointView::cut(const Piece& piece) {
  const std::size_t corners_before = next_.corners.size(), pieces_before = next_.all.size();
  const std::span<const Vec2> whole = now_.corners_of(piece);
  rest_.clear(whole.size());
  for (const Vec2& p : whole) rest_.push(p);
  for (const Line& line : shadow_) {
    if (!split(line)) {
      // Nothing is in the shadow after all: the piece stays whole.
      next_.corners.resize(corners_before), next_.all.resize(pieces_before);
      next_.add(whole, piece);
      return;
    }
    if (inside_.count == 0) continue;
    if (outside_.count > 0) next_.add(outside_.corners());
    std::swap(rest_, inside_);
  }
}

/// The form factors of all pieces.
double PointView::seen(const Vec3& normal) {
  double sum = 0;
  for (const Piece& piece : now_.all) {
    seen_.clear();
    for (const Vec2& p : now_.corners_of(piece)) seen_.push_back(origin_ + p.x * along_u_ + p.y * along_v_);
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
  find_cone();
  now_ = whole_;
  bool shadowed = false;
  for (const std::uint32_t index : which) {
    if (is_beside(obstructions[index], point) || !find_shadow(obstructions[index], point)) continue;
    std::size_t untouched = 0;
    while (untouched < now_.all.size() && misses(now_, now_.all[untouched])) ++untouched;
    if (untouched == now_.all.size()) continue;
    shadowed = true;
    next_.clear();
    for (std::size_t k = 0; k < now_.all.size(); ++k) {
      const Piece& piece = now_.all[k];
      if (k < untouched || (k > untouched && misses(now_, piece)))
        next_.add(now_.corners_of(piece), piece);
      else
        cut(piece);
    }
    std::swap(now_, next_);
    if (now_.all.empty()) return {unobstructed, 0};
  }
  return {unobstructed, shadowed ? seen(normal) : unobstructed};
}

}  // namespace lichthof
