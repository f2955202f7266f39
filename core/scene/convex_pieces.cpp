/// Concave polygons into convex pieces: ear clipping, then diagonals that no corner needs are taken out [Hertel83].
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/scene/polygon.hpp"

namespace lichthof {

namespace {

using Index = std::uint32_t;
using Piece = std::vector<Index>;

double cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }

/// Twice the signed area of a triangle.
double turn(const Vec2& a, const Vec2& b, const Vec2& c) { return cross(b - a, c - b); }

/// The polygon in coordinates of its own plane, relative to its first corner: far from the origin nothing is lost.
Polygon2 flattened(std::span<const Vec3> corners) {
  const Vec3 normal = glm::normalize(newell_vector(corners));
  const Vec3 across = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = glm::normalize(glm::cross(across, normal)), v = glm::cross(normal, u);
  Polygon2 flat;
  flat.reserve(corners.size());
  for (const Vec3& corner : corners)
    flat.push_back({glm::dot(corner - corners[0], u), glm::dot(corner - corners[0], v)});
  return flat;
}

/// The corners not yet cut off, each with its neighbours.
struct Ring {
  Piece before, after;
};

/// The cutting of one polygon. `tolerance_` is an area: a corner turning by less counts as straight.
class Cutter {
 public:
  explicit Cutter(Polygon2 points) : points_(std::move(points)) {
    Vec2 lo = points_[0], hi = points_[0];
    for (const Vec2& p : points_) lo = glm::min(lo, p), hi = glm::max(hi, p);
    const double size = glm::length(hi - lo);
    tolerance_ = 1e-12 * size * size;
  }

  bool crosses_itself() const;
  /// @returns false when no ear is left
  bool clip_ears();
  std::vector<Piece> merged() const;
  bool convex() const {
    Piece all(points_.size());
    for (Index i = 0; i < all.size(); ++i) all[i] = i;
    return convex(all);
  }

 private:
  bool convex(const Piece& piece) const;
  bool is_ear(const Ring& ring, Index tip, bool boundary_blocks) const;
  Piece spliced(const Piece& a, const Piece& b, Index from, Index to) const;

  Polygon2 points_;
  double tolerance_;
  std::vector<Piece> triangles_;
};

/// Two edges that cross in their insides; edges that merely touch (bridges to holes) are allowed.
bool Cutter::crosses_itself() const {
  const std::size_t n = points_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 &a = points_[i], &b = points_[(i + 1) % n];
    const Vec2 lo = glm::min(a, b), hi = glm::max(a, b);
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;
      const Vec2 &c = points_[j], &d = points_[(j + 1) % n];
      if (std::max(c.x, d.x) < lo.x || std::min(c.x, d.x) > hi.x || std::max(c.y, d.y) < lo.y ||
          std::min(c.y, d.y) > hi.y)
        continue;
      const double c_side = turn(a, b, c), d_side = turn(a, b, d), a_side = turn(c, d, a), b_side = turn(c, d, b);
      const auto apart = [this](double s, double t) {
        return (s > tolerance_ && t < -tolerance_) || (s < -tolerance_ && t > tolerance_);
      };
      if (apart(c_side, d_side) && apart(a_side, b_side)) return true;
    }
  }
  return false;
}

/// A corner whose triangle holds no corner that bends inwards or runs straight. Corners in the same place as one of the
/// triangle's (bridges to holes visit a place twice) do not count.
bool Cutter::is_ear(const Ring& ring, Index tip, bool boundary_blocks) const {
  const Index before = ring.before[tip], after = ring.after[tip];
  const Vec2 &a = points_[before], &b = points_[tip], &c = points_[after];
  if (turn(a, b, c) <= tolerance_) return false;
  const double margin = boundary_blocks ? -tolerance_ : tolerance_;
  for (Index k = ring.after[after]; k != before; k = ring.after[k]) {
    const Vec2& p = points_[k];
    if (p == a || p == b || p == c) continue;
    if (turn(a, b, p) < margin || turn(b, c, p) < margin || turn(c, a, p) < margin) continue;
    if (turn(points_[ring.before[k]], p, points_[ring.after[k]]) <= tolerance_) return false;
  }
  return true;
}

/// Cutting an ear off changes only whether its two neighbours are ears (O'Rourke, Computational Geometry in C, 1998,
/// section 1.6); so the answers are kept, and asked for anew only where rounding has left none.
bool Cutter::clip_ears() {
  const auto n = static_cast<Index>(points_.size());
  Ring ring{Piece(n), Piece(n)};
  for (Index i = 0; i < n; ++i) ring.before[i] = (i + n - 1) % n, ring.after[i] = (i + 1) % n;
  std::vector<char> ear(n, 0);
  Index left = n, at = 0;
  constexpr int most_renewals = 8;
  for (int renewals = 0; left > 3;) {
    Index tried = 0;
    while (tried < left && !ear[at]) at = ring.after[at], ++tried;
    if (!ear[at]) {
      if (renewals++ == most_renewals) return false;
      // Corners that touch a diagonal from outside block ears of polygons with bridges; the second look lets them.
      for (Index i = 0; i < left; ++i, at = ring.after[at]) ear[at] = is_ear(ring, at, renewals % 2 == 1);
      if (std::find(ear.begin(), ear.end(), 1) == ear.end() && renewals % 2 == 0) break;
      continue;
    }
    const Index before = ring.before[at], after = ring.after[at];
    triangles_.push_back({before, at, after});
    ear[at] = 0;
    ring.after[before] = after, ring.before[after] = before;
    --left;
    ear[before] = is_ear(ring, before, true), ear[after] = is_ear(ring, after, true);
    // Going on behind the cut keeps the triangles from fanning out of one corner.
    at = ring.after[after];
  }
  // What is left without an ear must have no area (spikes, straight corners); else the polygon is no simple one.
  double rest = 0;
  for (Index i = ring.after[at]; ring.after[i] != at; i = ring.after[i])
    rest += turn(points_[at], points_[i], points_[ring.after[i]]);
  if (left == 3 && rest > tolerance_) {
    triangles_.push_back({ring.before[at], at, ring.after[at]});
    rest = 0;
  }
  return std::abs(rest) <= tolerance_ * n && !triangles_.empty();
}

bool Cutter::convex(const Piece& piece) const {
  const std::size_t n = piece.size();
  double turned = 0;  // a full circle; two where the corners run round twice
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 in = points_[piece[i]] - points_[piece[(i + n - 1) % n]];
    const Vec2 out = points_[piece[(i + 1) % n]] - points_[piece[i]];
    // A straight corner passes, by the measure of is_convex(); a spike, which also has no area, turns back.
    const double straight = 1e-9 * glm::length(in) * glm::length(out);
    if (cross(in, out) < -straight || (cross(in, out) <= straight && glm::dot(in, out) < 0)) return false;
    turned += std::atan2(cross(in, out), glm::dot(in, out));
  }
  return n >= 3 && turned < 10.0;
}

/// Both pieces without the diagonal they share: `from`-`to` in a, `to`-`from` in b.
Piece Cutter::spliced(const Piece& a, const Piece& b, Index from, Index to) const {
  Piece result;
  const auto place = [](const Piece& piece, Index corner) {
    return static_cast<std::size_t>(std::find(piece.begin(), piece.end(), corner) - piece.begin());
  };
  const std::size_t start_a = place(a, to), start_b = place(b, from);
  for (std::size_t i = 0; i + 1 < a.size(); ++i) result.push_back(a[(start_a + i) % a.size()]);
  for (std::size_t i = 0; i + 1 < b.size(); ++i) result.push_back(b[(start_b + i) % b.size()]);
  return result;
}

std::vector<Piece> Cutter::merged() const {
  std::vector<Piece> pieces = triangles_;
  std::vector<std::size_t> owner(pieces.size());
  for (std::size_t i = 0; i < owner.size(); ++i) owner[i] = i;
  const auto root = [&owner](std::size_t i) {
    while (owner[i] != i) i = owner[i] = owner[owner[i]];
    return i;
  };
  std::map<std::pair<Index, Index>, std::size_t> edges;  // directed edge → its triangle
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) edges[{triangles_[t][k], triangles_[t][(k + 1) % 3]}] = t;

  for (const auto& [edge, triangle] : edges) {
    const auto [from, to] = edge;
    const auto twin = edges.find({to, from});
    if (from > to || twin == edges.end()) continue;
    const std::size_t a = root(triangle), b = root(twin->second);
    if (a == b) continue;
    Piece joint = spliced(pieces[a], pieces[b], from, to);
    if (!convex(joint)) continue;
    pieces[a] = std::move(joint);
    pieces[b].clear();
    owner[b] = a;
  }
  std::erase_if(pieces, [](const Piece& piece) { return piece.empty(); });
  return pieces;
}

}  // namespace

std::vector<std::vector<std::uint32_t>> convex_pieces(std::span<const Vec3> corners) {
  if (corners.size() < 3 || glm::length(newell_vector(corners)) == 0) return {};
  Cutter cutter(flattened(corners));
  if (cutter.crosses_itself()) return {};
  if (cutter.convex()) {
    Piece whole(corners.size());
    for (Index i = 0; i < whole.size(); ++i) whole[i] = i;
    return {whole};
  }
  if (!cutter.clip_ears()) return {};
  return cutter.merged();
}

}  // namespace lichthof
