#include "core/light/exchange_area.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace lichthof {

namespace {

/// Gauss-Legendre quadrature of 10 points on [-1, 1]: the positive nodes, and weights.
constexpr std::array<double, 5> gauss_node{0.14887433898163121, 0.43339539412924719, 0.67940956829902441,
                                           0.86506336668898451, 0.97390652851717172};
constexpr std::array<double, 5> gauss_weight{0.29552422471475287, 0.26926671930999636, 0.21908636251598204,
                                             0.14945134915058059, 0.066671344308688138};

/// Directions that differ by less count as parallel, and as perpendicular (rad).
constexpr double same_direction = 1e-8, perpendicular = 1e-15;
/// First panel at a place where edges touch, as a share of the edge: what its quadrature misses is below the square of it.
constexpr double first_panel = 1e-6;

struct Edge {
  Vec3 from, direction;
  double length = 0;
  Vec3 at(double s) const { return from + s * direction; }
  double foot(const Vec3& x) const { return glm::dot(x - from, direction); }
};

Edge edge_between(const Vec3& from, const Vec3& to) {
  const double length = glm::length(to - from);
  return {from, length > 0 ? (to - from) / length : Vec3{0.0}, length};
}

/// ∫ ln |x - y| dy along the edge, but for -length: around a closed polygon those add up to nothing.
double potential(const Vec3& x, const Edge& edge) {
  const Vec3 d = x - edge.from;
  const double foot = glm::dot(d, edge.direction);
  const Vec3 across = d - foot * edge.direction;
  const double square = glm::dot(across, across), distance = std::sqrt(square);
  const double ahead = edge.length - foot, behind = -foot;
  const auto half_log = [square](double t) {
    const double r = t * t + square;
    return r > 0 ? 0.5 * t * std::log(r) : 0.0;
  };
  return half_log(ahead) - half_log(behind) + distance * std::atan2(distance * edge.length, square + ahead * behind);
}

/// One edge's potential along another edge.
class AlongEdge {
 public:
  AlongEdge(const Edge& along, const Edge& of, double cosine);
  double integral() const;

 private:
  double panel(double from, double to) const;
  double graded(double from, double to, double scale) const;
  double nearness(double s) const;
  double over(double from, double to) const;

  const Edge& along_;
  const Edge& of_;
  bool crossing_ = false;     ///< the lines come closest at one place
  double closest_ = 0;        ///< that place on along_
  double closest_scale_ = 0;  ///< how far from it their distance has a root, off the real axis
};

AlongEdge::AlongEdge(const Edge& along, const Edge& of, double cosine) : along_(along), of_(of) {
  const Vec3 turn = glm::cross(along.direction, of.direction);
  const double sine_square = glm::dot(turn, turn);
  if (sine_square <= same_direction * same_direction) return;
  crossing_ = true;
  const Vec3 between = of.from - along.from;
  closest_ = (glm::dot(between, along.direction) - cosine * glm::dot(between, of.direction)) / sine_square;
  closest_scale_ = std::abs(glm::dot(between, turn)) / sine_square;
}

double AlongEdge::panel(double from, double to) const {
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
  double sum = 0;
  for (std::size_t k = 0; k < gauss_node.size(); ++k) {
    const double shift = half * gauss_node[k];
    sum += gauss_weight[k] * (potential(along_.at(middle - shift), of_) + potential(along_.at(middle + shift), of_));
  }
  return half * sum;
}

/// Between `from`, near which the integrand is not smooth on the scale given, and `to`, on whichever side.
double AlongEdge::graded(double from, double to, double scale) const {
  const double length = std::abs(to - from), sign = to > from ? 1 : -1;
  double sum = 0, done = 0, step = std::max(scale, first_panel * length);
  while (done < length) {
    const double end = std::min(done + step, length);
    sum += sign * panel(from + sign * done, from + sign * end);
    done = step = end;
  }
  return sum;
}

/// Distance from a place on along_ to the nearest complex one where the potential is not analytic.
double AlongEdge::nearness(double s) const {
  const Vec3 x = along_.at(s);
  double nearest = std::min(glm::length(x - of_.from), glm::length(x - of_.at(of_.length)));
  if (crossing_) nearest = std::min(nearest, std::hypot(s - closest_, closest_scale_));
  return nearest;
}

double AlongEdge::over(double from, double to) const {
  const double length = to - from, here = nearness(from), there = nearness(to);
  if (here >= length && there >= length) return panel(from, to);
  const double middle = 0.5 * (from + to);
  return graded(from, middle, here) + graded(to, middle, there);
}

double AlongEdge::integral() const {
  const double apart = glm::length(along_.at(0.5 * along_.length) - of_.at(0.5 * of_.length)) - 0.5 * of_.length;
  if (apart > 1.5 * along_.length) return panel(0, along_.length);
  // Every place where the integrand is least smooth becomes the end of an interval.
  std::array<double, 5> end{0, along_.length, along_.foot(of_.from), along_.foot(of_.at(of_.length)),
                            crossing_ ? closest_ : 0};
  for (double& place : end) place = std::clamp(place, 0.0, along_.length);
  std::sort(end.begin(), end.end());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < end.size(); ++k)
    if (end[k + 1] > end[k]) sum += over(end[k], end[k + 1]);
  return sum;
}

}  // namespace

double exchange_area(std::span<const Vec3> first, std::span<const Vec3> second) {
  const auto edge_of = [](std::span<const Vec3> corners, std::size_t k) {
    return edge_between(corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
  };
  double sum = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Edge a = edge_of(first, i);
    for (std::size_t j = 0; j < second.size(); ++j) {
      const Edge b = edge_of(second, j);
      const double cosine = glm::dot(a.direction, b.direction);
      if (std::abs(cosine) < perpendicular || a.length == 0 || b.length == 0) continue;
      // The shorter edge is the one to integrate along: the longer one's potential is the smoother there.
      const Edge& along = a.length <= b.length ? a : b;
      const Edge& of = a.length <= b.length ? b : a;
      sum += cosine * AlongEdge(along, of, cosine).integral();
    }
  }
  return std::max(0.0, sum / (2.0 * std::numbers::pi));
}

}  // namespace lichthof
