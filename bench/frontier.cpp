#include "bench/frontier.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/base/check.hpp"

namespace lichthof::bench {

std::vector<std::size_t> frontier(std::span<const CostError> runs) {
  std::vector<std::size_t> order(runs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(runs[a].cpu_s, runs[a].error) < std::tie(runs[b].cpu_s, runs[b].error);
  });
  std::vector<std::size_t> best;
  for (const std::size_t k : order)
    if (best.empty() || runs[k].error < runs[best.back()].error) best.push_back(k);
  return best;
}

double log_log_slope(std::span<const Vec2> points) {
  MUST(points.size() >= 2);
  Vec2 mean{0.0};
  for (const Vec2& p : points) mean += Vec2{std::log(p.x), std::log(p.y)} / static_cast<double>(points.size());
  double xx = 0, xy = 0;
  for (const Vec2& p : points) {
    const double x = std::log(p.x) - mean.x, y = std::log(p.y) - mean.y;
    xx += x * x, xy += x * y;
  }
  MUST(xx > 0);
  return xy / xx;
}

SquareRootLaw::SquareRootLaw(std::span<const CostError> runs) {
  MUST(!runs.empty());
  double sum = 0;
  for (const CostError& run : runs) sum += std::log(run.error) + 0.5 * std::log(run.cpu_s);
  constant_ = std::exp(sum / static_cast<double>(runs.size()));
}

double SquareRootLaw::error(double cpu_s) const { return constant_ / std::sqrt(cpu_s); }

}  // namespace lichthof::bench
