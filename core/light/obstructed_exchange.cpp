#include "core/light/obstructed_exchange.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/light/exchange_area.hpp"
#include "core/light/point_view.hpp"

namespace lichthof {

namespace {

/// Tolerance of cuts, where only rounding in double precision matters, as a share of that of planes.
constexpr double cut_share = 1e-3;

struct RulePoint {
  double u, v;    ///< barycentric: corner 0 has the rest
  double fine;    ///< weight in the rule of degree 8
  double coarse;  ///< weight in the rule of degree 5
  double other;   ///< weight in the rule of degree 3 of the points that the coarse one leaves out
  double closed;  ///< weight in the rule of degree 3 that looks from the triangle's corners and sides
};

/// The 19 points of [Laurie82], whose first 7 are the coarse rule's, then 6 on the border, drawn in a little: they may lie in an
/// obstruction's plane there.
constexpr std::array<RulePoint, 25> rule = [] {
  struct Three {
    double twice, fine, coarse, other, closed;
  };
  constexpr double drawn_in = 1e-4;
  constexpr std::array<Three, 6> threes{{{0.1012865073234563, 0.0376204254131829, 0.1259391805448271, 0, 0},
                                         {0.4701420641051151, 0.0783573522441174, 0.1323941527885062, 0, 0},
                                         {0.2321023267750504, 0.1162714796569659, 0, 0.1626010355654214, 0},
                                         {0.0294808608844396, 0.0134442673751655, 0, 0.0001016624744617, 0},
                                         {drawn_in / 3, 0, 0, 0, 1.0 / 20},
                                         {0.5 - drawn_in / 6, 0, 0, 0, 2.0 / 15}}};
  std::array<RulePoint, 25> points{};
  std::size_t at = 0;
  points[at++] = {1.0 / 3, 1.0 / 3, 0.0378610912003147, 0.225, 0, 9.0 / 20};
  for (const Three& t : threes) {
    const double once = 1 - 2 * t.twice;
    points[at++] = {t.twice, t.twice, t.fine, t.coarse, t.other, t.closed};
    points[at++] = {t.twice, once, t.fine, t.coarse, t.other, t.closed};
    points[at++] = {once, t.twice, t.fine, t.coarse, t.other, t.closed};
  }
  constexpr double a = 0.7384168123405100, b = 0.2321023267750504, c = 1 - a - b, weight = 0.0375097224552317,
                   other = 0.0853153176467251;
  constexpr std::array<std::array<double, 2>, 6> six{{{a, b}, {b, a}, {a, c}, {c, a}, {b, c}, {c, b}}};
  for (const auto& [u, v] : six) points[at++] = {u, v, weight, 0, other, 0};
  return points;
}();

/// Where shadows have edges all rules are about as far off as from each other; this covers the better ones' luck.
constexpr double safety = 3;

/// How much the closed rule counts: it shall find a shadow at the border that the others miss, which is then narrower than the
/// distance of their outermost points, and it overrates such a shadow by more than this.
constexpr double closed_share = 0.1;

/// What halving a triangle changed is its own error; this much of it is taken to be left in the halves at least.
constexpr double change_share = 0.25;

/// A triangle all of whose points see the source past all obstructions, or nothing of it, may hold a part where that is not so:
/// it is taken to be one point's share at most.
constexpr double doubt_share = 1.0 / 25;

/// Triangles' errors add up as those of independent estimates do, but for this share, which has the same sign in all: along one
/// straight shadow all triangles are cut alike.
constexpr double alike_share = 0.1;

/// Share of the allowed error from which on it is worth asking where the rule misses something of the whole exchange.
constexpr double missed_share = 1e-3;

/// The rules' sums over a triangle of area 1.
struct RuleSums {
  double fine = 0, coarse = 0, other = 0, closed = 0;
  void add(const RulePoint& point, double value) {
    fine += point.fine * value, coarse += point.coarse * value;
    other += point.other * value, closed += point.closed * value;
  }
  /// Two rules that share no point are seldom both right by chance.
  double error() const {
    return safety * std::max({std::abs(fine - coarse), std::abs(fine - other), closed_share * std::abs(fine - closed)});
  }
};

struct Triangle {
  std::array<Vec3, 3> corner;
  double area = 0;              ///< m²
  double value = 0, error = 0;  ///< of the exchange area (m²)
  std::vector<std::uint32_t> between;
};

bool less_wrong(const Triangle& a, const Triangle& b) { return a.error < b.error; }

/// The part of a segment inside a convex polygon of its plane. @returns false when it only touches
bool clip_segment(const Polygon& polygon, const Vec3& normal, double tolerance, Vec3& from, Vec3& to) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 edge = polygon[k + 1 < polygon.size() ? k + 1 : 0] - polygon[k];
    const Vec3 inwards = glm::normalize(glm::cross(normal, edge));
    const double a = glm::dot(inwards, from - polygon[k]), b = glm::dot(inwards, to - polygon[k]);
    if (a <= tolerance && b <= tolerance) return false;
    if (a < 0)
      from += a / (a - b) * (to - from);
    else if (b < 0)
      to += b / (b - a) * (from - to);
  }
  return glm::length(to - from) > tolerance;
}

/// Calls cut(from, to) for every edge of an obstruction that lies in the receiver's plane.
template <class Cut>
void for_each_standing(const FacingPair& pair, double tolerance, Cut cut) {
  const auto on_receiver = [&](const Vec3& p) {
    return glm::dot(pair.receiver_normal, p - pair.receiver.front()) <= tolerance;
  };
  for (const Obstruction& o : pair.between)
    for_each_edge(o, [&](const Vec3& from, const Vec3& to) {
      if (on_receiver(from) && on_receiver(to)) cut(from, to);
    });
}

/// The receiver in pieces, none of which an obstruction stands on. Only pieces that a segment really crosses are cut.
std::vector<Polygon> pieces_between_standing(const FacingPair& pair, double tolerance) {
  constexpr std::size_t most_pieces = 512;  // beyond, halving has to find the rest
  std::vector<Polygon> pieces{pair.receiver};
  const Vec3& normal = pair.receiver_normal;
  for_each_standing(pair, tolerance, [&](const Vec3& first, const Vec3& second) {
    for (std::size_t k = pieces.size(); k-- > 0 && pieces.size() < most_pieces;) {
      Vec3 from = first, to = second;
      if (!clip_segment(pieces[k], normal, tolerance, from, to)) continue;
      const Vec3 across = glm::normalize(glm::cross(normal, second - first));
      const double offset = glm::dot(across, first);
      Polygon left = clipped(pieces[k], across, offset, tolerance);
      Polygon right = clipped(pieces[k], -across, -offset, tolerance);
      if (left.empty() || right.empty()) continue;
      pieces[k] = std::move(left);
      pieces.push_back(std::move(right));
    }
  });
  return pieces;
}

class Integrator {
 public:
  Integrator(const FacingPair& pair, double allowed_error, double tolerance, Clear clear)
      : pair_(pair), allowed_error_(allowed_error), plane_tolerance_(tolerance), tolerance_(cut_share * tolerance),
        clear_(clear), view_(tolerance_) {}
  Exchange integral(std::uint64_t most_points);

 private:
  Triangle triangle(const std::array<Vec3, 3>& corner, const std::vector<std::uint32_t>& between);
  void push(Triangle t);
  void evaluate(Triangle& triangle);
  double doubt(const Triangle& triangle, bool dark, double unobstructed);
  bool is_near_obstructed(const Triangle& triangle) const;
  void halve_worst();
  /// Of all triangles together (m²).
  double error() const { return std::sqrt(std::max(0.0, error_square_)) + alike_share * error_sum_; }

  const FacingPair& pair_;
  double allowed_error_, plane_tolerance_, tolerance_;
  Clear clear_;
  PointView view_;
  double receiver_area_ = 0;
  double error_square_ = 0;  ///< sum over all triangles (m⁴)
  double error_sum_ = 0;     ///< likewise (m²)
  std::vector<Triangle> heap_;
  Exchange result_;
};

/// Both rules on the visible and on the hidden part; the better of the two becomes the triangle's value.
void Integrator::evaluate(Triangle& t) {
  const Vec3 u = t.corner[1] - t.corner[0], v = t.corner[2] - t.corner[0];
  RuleSums visible, hidden;
  std::size_t clear_points = 0, dark_points = 0;
  for (const RulePoint& p : rule) {
    const PointView::Factors f =
        view_.factors(t.corner[0] + p.u * u + p.v * v, pair_.receiver_normal, pair_.source, pair_.between, t.between);
    visible.add(p, f.visible);
    hidden.add(p, f.unobstructed - f.visible);
    clear_points += f.visible >= (1 - 1e-12) * f.unobstructed;
    dark_points += f.visible == 0;
  }
  result_.points += rule.size();
  t.value = t.area * visible.fine;
  t.error = t.area * visible.error();
  if (t.between.empty() && clear_ == Clear::quadrature) return;
  const double unobstructed = exchange_area(t.corner, pair_.source), other_error = t.area * hidden.error();
  if (clear_ == Clear::contour && other_error < 0.5 * t.error) {
    t.value = unobstructed - t.area * hidden.fine;
    t.error = other_error;
  }
  if (t.between.empty()) return;
  // What the points miss even of the whole exchange lies where the source is near: is anything between there?
  const double missed = std::abs(unobstructed - t.area * (visible.fine + hidden.fine));
  if (missed > missed_share * allowed_error_ && is_near_obstructed(t)) t.error += missed;
  if (clear_points == rule.size() || dark_points == rule.size())
    t.error += doubt(t, dark_points == rule.size(), unobstructed);
}

/// Whether something stands between a triangle and what of the source is no further from it than its own size.
bool Integrator::is_near_obstructed(const Triangle& t) const {
  Box box;
  for (const Vec3& p : t.corner) box.include(p);
  const double margin = glm::length(box.size());
  Polygon near = pair_.source;
  for (int axis = 0; axis < 3 && !near.empty(); ++axis) {
    Vec3 direction{0.0};
    direction[axis] = 1;
    near = clipped(near, direction, box.lo[axis] - margin, tolerance_);
    if (!near.empty()) near = clipped(near, -direction, -box.hi[axis] - margin, tolerance_);
  }
  if (near.empty()) return false;
  const ViewShaft shaft(t.corner, near, tolerance_);
  return std::any_of(t.between.begin(), t.between.end(),
                     [&](std::uint32_t index) { return shaft.may_hold(pair_.between[index]); });
}

/// How far off a triangle may be all of whose points agree. One that is dark sees no more than what lies outside the umbrae.
double Integrator::doubt(const Triangle& t, bool dark, double unobstructed) {
  double at_stake = unobstructed;
  if (dark) {
    at_stake = 0;
    for (const Polygon& piece : outside_umbrae(pair_.between, t.between, t.corner, pair_.source, tolerance_))
      at_stake += exchange_area(t.corner, piece);
  }
  return doubt_share * at_stake * std::sqrt(t.area / receiver_area_);
}

/// @param between  what the triangle's parent had between; what reaches its own shaft stays
Triangle Integrator::triangle(const std::array<Vec3, 3>& corner, const std::vector<std::uint32_t>& between) {
  Triangle t;
  t.corner = corner;
  t.area = area(corner);
  const ViewShaft shaft(corner, pair_.source, tolerance_);
  for (const std::uint32_t index : between) {
    if (!shaft.may_hold(pair_.between[index])) continue;
    if (hides_all(pair_.between[index], corner, pair_.source, tolerance_)) {
      t.between.clear();
      return t;
    }
    t.between.push_back(index);
  }
  evaluate(t);
  return t;
}

void Integrator::push(Triangle t) {
  error_square_ += t.error * t.error, error_sum_ += t.error;
  heap_.push_back(std::move(t));
  std::push_heap(heap_.begin(), heap_.end(), less_wrong);
}

/// Across its longest side.
void Integrator::halve_worst() {
  std::pop_heap(heap_.begin(), heap_.end(), less_wrong);
  const Triangle t = std::move(heap_.back());
  heap_.pop_back();
  error_square_ -= t.error * t.error, error_sum_ -= t.error;
  std::size_t longest = 0;
  double length = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (const double l = glm::length(t.corner[(k + 1) % 3] - t.corner[k]); l > length) length = l, longest = k;
  const Vec3 &a = t.corner[longest], &b = t.corner[(longest + 1) % 3], &c = t.corner[(longest + 2) % 3];
  const Vec3 middle = 0.5 * (a + b);
  Triangle left = triangle({a, middle, c}, t.between), right = triangle({middle, b, c}, t.between);
  // What the halves have changed, they may be wrong by in part.
  const double changed = std::abs(left.value + right.value - t.value), least = 0.5 * change_share * changed;
  for (Triangle* half : {&left, &right}) {
    if (!half->between.empty()) half->error = std::max(half->error, least);
    push(std::move(*half));
  }
}

Exchange Integrator::integral(std::uint64_t most_points) {
  receiver_area_ = area(pair_.receiver);
  std::vector<std::uint32_t> all(pair_.between.size());
  for (std::uint32_t k = 0; k < all.size(); ++k) all[k] = k;
  for (const Polygon& piece : pieces_between_standing(pair_, plane_tolerance_))
    for (std::size_t k = 1; k + 1 < piece.size(); ++k) push(triangle({piece[0], piece[k], piece[k + 1]}, all));
  do {
    while (error() > allowed_error_ && result_.points < most_points) halve_worst();
    // The running sums have drifted by rounding: what counts is summed anew.
    error_square_ = error_sum_ = 0;
    for (const Triangle& t : heap_) error_square_ += t.error * t.error, error_sum_ += t.error;
  } while (error() > allowed_error_ && result_.points < most_points);
  for (const Triangle& t : heap_) result_.area += t.value;
  result_.error = error();
  return result_;
}

}  // namespace

std::size_t standing_count(const FacingPair& pair, double tolerance) {
  std::size_t count = 0;
  for_each_standing(pair, tolerance, [&](Vec3 from, Vec3 to) {
    count += clip_segment(pair.receiver, pair.receiver_normal, tolerance, from, to);
  });
  return count;
}

Exchange obstructed_exchange(const FacingPair& pair, double allowed_error, double tolerance, std::uint64_t most_points,
                             Clear clear) {
  return Integrator(pair, allowed_error, tolerance, clear).integral(most_points);
}

}  // namespace lichthof
