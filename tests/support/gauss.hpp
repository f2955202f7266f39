/// Gauss-Legendre quadrature, for references that are integrals.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace lichthof::test {

/// Nodes and weights on [0, 1]: exact for polynomials up to the degree 2 count - 1.
struct Gauss {
  std::vector<double> node, weight;
  explicit Gauss(int count) {
    for (int i = 0; i < count; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5)), slope = 1;
      for (int step = 0; step < 50; ++step) {
        double p = 1, before = 0;
        for (int k = 1; k <= count; ++k) {
          const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
          before = p, p = next;
        }
        slope = count * (x * p - before) / (x * x - 1);
        x -= p / slope;
      }
      node.push_back(0.5 * (x + 1));
      weight.push_back(1 / ((1 - x * x) * slope * slope));
    }
  }
  double over(const std::function<double(double)>& f) const {
    double sum = 0;
    for (std::size_t i = 0; i < node.size(); ++i) sum += weight[i] * f(node[i]);
    return sum;
  }
};

}  // namespace lichthof::test
