/// View factors with known answers: closed forms in extended precision, and integrals that leave one or two dimensions.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/support/gauss.hpp"

namespace lichthof::reference {

/// Two equal rectangles a x b, parallel at distance 1, opposite each other [Howell's catalogue C-11].
inline double parallel_plates(double a, double b) {
  const long double x = a, y = b, xx = 1 + x * x, yy = 1 + y * y, pi = std::numbers::pi_v<long double>;
  const long double sum = std::log(std::sqrt(xx * yy / (xx + y * y))) +
                          x * std::sqrt(yy) * std::atan(x / std::sqrt(yy)) +
                          y * std::sqrt(xx) * std::atan(y / std::sqrt(xx)) - x * std::atan(x) - y * std::atan(y);
  return static_cast<double>(2 * sum / (pi * x * y));
}

/// Exchange area of two perpendicular rectangles with a common edge of length 1, w and h wide [Howell's catalogue C-14].
inline double perpendicular_exchange(double width, double height) {
  const long double w = width, h = height, ww = w * w, hh = h * h, pi = std::numbers::pi_v<long double>;
  const long double logs = std::log((1 + ww) * (1 + hh) / (1 + ww + hh)) +
                           ww * std::log(ww * (1 + ww + hh) / ((1 + ww) * (ww + hh))) +
                           hh * std::log(hh * (1 + ww + hh) / ((1 + hh) * (ww + hh)));
  const long double sum =
      w * std::atan(1 / w) + h * std::atan(1 / h) - std::sqrt(ww + hh) * std::atan(1 / std::sqrt(ww + hh)) + logs / 4;
  return static_cast<double>(sum / pi);
}

/// Quadrature of 24 points over each interval between neighbouring ends.
inline double integral(const std::vector<double>& ends, const std::function<double(double)>& f) {
  static const test::Gauss gauss(24);
  double sum = 0;
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    const double length = ends[k + 1] - ends[k];
    sum += length * gauss.over([&](double x) { return f(ends[k] + length * x); });
  }
  return sum;
}

/// What a square of side s, half way between two unit plates at distance 1 and centred, hides of their exchange. A line of
/// sight meets it where the middle of its ends lies in it, so two of the four integrals are lengths of intervals:
/// ∫∫ min(1 - |x|, s) min(1 - |y|, s) / (π (1 + x² + y²)²) dx dy, x and y being the ends' differences.
inline double hidden_by_square_between_plates(double side) {
  const auto ends = std::vector<double>{0, 1 - side, 1};
  return 4 * integral(ends, [&](double x) {
           return integral(ends, [&](double y) {
             const double square = 1 + x * x + y * y;
             return std::min(1 - x, side) * std::min(1 - y, side) / (std::numbers::pi * square * square);
           });
         });
}

/// What a wall of height h on the middle line of the lower of two unit plates at distance 1, and longer than they are, hides
/// of their exchange. Of lines of sight that run x sideways, those that begin between max(-1/2, -h x) and min(0, 1/2 - x)
/// cross the middle below the wall's top.
inline double hidden_by_wall_between_plates(double height) {
  // Kinks: where h x = 1/2, where x = 1/2, and where the interval ends.
  std::vector<double> ends{0, 0.5, std::min(0.5 / height, 1.0), 1};
  if (height < 1) ends.insert(ends.end() - 1, 0.5 / (1 - height) < 1 ? 0.5 / (1 - height) : 1.0);
  std::sort(ends.begin(), ends.end());
  return 2 * integral(ends, [&](double x) {
           const double starts = std::max(0.0, std::min(0.0, 0.5 - x) - std::max(-0.5, -height * x));
           return starts * 2 * integral({0, 1}, [&](double y) {
                    const double square = 1 + x * x + y * y;
                    return (1 - y) / (std::numbers::pi * square * square);
                  });
         });
}

}  // namespace lichthof::reference
