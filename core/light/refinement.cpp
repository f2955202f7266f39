#include "core/light/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

constexpr int tile_side = 4;
constexpr std::uint8_t finest = 8;
/// Of the deviation of a patch this share is left when its elements are half as large: 1/16 where light is smooth, 1/2 along
/// a shadow's edge, which is where most of it is.
constexpr double left_of_refined = 0.4;

/// The plane a + b x + c y through weighted values, by normal equations about the centre of gravity.
class PlaneFit {
 public:
  void add(const Vec2& at, double weight, double value) { samples_.push_back({at, weight, value}); }

  /// Σ w (value - plane)²
  double deviation() const {
    double weight = 0, mean = 0;
    Vec2 middle{0.0};
    for (const Sample& s : samples_) weight += s.weight, mean += s.weight * s.value, middle += s.weight * s.at;
    if (!(weight > 0)) return 0;
    mean /= weight, middle /= weight;
    double xx = 0, xy = 0, yy = 0, xv = 0, yv = 0;
    for (const Sample& s : samples_) {
      const Vec2 d = s.at - middle;
      xx += s.weight * d.x * d.x, xy += s.weight * d.x * d.y, yy += s.weight * d.y * d.y;
      xv += s.weight * d.x * (s.value - mean), yv += s.weight * d.y * (s.value - mean);
    }
    // A row of elements has no slope across: its part of the solution is left at 0.
    const double trace = xx + yy, determinant = xx * yy - xy * xy;
    Vec2 slope{0.0};
    if (determinant > 1e-9 * trace * trace)
      slope = {(yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant};
    else if (trace > 0)
      slope = Vec2{xv, yv} / trace;
    double sum = 0;
    for (const Sample& s : samples_) {
      const double rest = s.value - mean - glm::dot(slope, s.at - middle);
      sum += s.weight * rest * rest;
    }
    return sum;
  }

 private:
  struct Sample {
    Vec2 at;
    double weight, value;
  };
  std::vector<Sample> samples_;
};

}  // namespace

std::vector<double> deviations(const Solution& solution) {
  const Mesh& mesh = *solution.mesh;
  std::vector<double> result(mesh.patches.size(), 0.0);
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    if (!mesh.group_is_lit[patch.group.value]) continue;
    std::map<std::pair<int, int>, std::array<PlaneFit, 3>> tiles;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Element& element = mesh.elements[e];
      auto& fits = tiles[{element.row / tile_side, element.column / tile_side}];
      const Rgb value{solution.direct_irradiance[e]};
      for (int c = 0; c < 3; ++c) fits[static_cast<std::size_t>(c)].add(element.centre, element.area, value[c]);
    }
    for (const auto& [place, fits] : tiles)
      for (const PlaneFit& fit : fits) result[p] += fit.deviation();
  }
  return result;
}

std::vector<std::uint8_t> refined(const Mesh& mesh, const std::vector<double>& deviation, double keep) {
  MUST(deviation.size() == mesh.patches.size() && keep > 0);
  std::vector<std::uint8_t> fineness = mesh.fineness;
  fineness.resize(mesh.patches.size(), 1);
  std::vector<std::uint32_t> order(mesh.patches.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto gain = [&](std::uint32_t p) { return deviation[p] / mesh.patches[p].element_count; };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return gain(a) != gain(b) ? gain(a) > gain(b) : a < b; });
  const double whole = std::accumulate(deviation.begin(), deviation.end(), 0.0);
  double left = whole;
  for (const std::uint32_t p : order) {
    if (left <= keep * whole) break;
    if (fineness[p] >= finest) continue;
    fineness[p] = static_cast<std::uint8_t>(2 * fineness[p]);
    left -= (1 - left_of_refined) * deviation[p];
  }
  return fineness;
}

}  // namespace lichthof
