#include "core/light/point_view.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/base/random.hpp"
#include "core/light/form_factor.hpp"

using namespace lichthof;

namespace {

constexpr double tolerance = 1e-11;  // m, beside sizes of 1 m
constexpr double rounding = 1e-10;   // of a form factor: ten times what the tolerance may cost
const Vec3 up{0, 0, 1}, eye{0.3, 0.4, 0};

Polygon rectangle(double x0, double y0, double x1, double y1, double z) {
  return {{x0, y0, z}, {x0, y1, z}, {x1, y1, z}, {x1, y0, z}};
}

const Polygon source = rectangle(-1, -1, 1, 1, 2);

/// The obstruction at half the height that hides just this part of the plane z = 2 from the eye.
Obstruction hiding(double x0, double y0, double x1, double y1) {
  Polygon corners = rectangle(x0, y0, x1, y1, 2);
  for (Vec3& p : corners) p = 0.5 * (p + eye);
  return obstruction(corners, {0, 0, -1});
}

double visible(const std::vector<Obstruction>& obstructions) {
  std::vector<std::uint32_t> all(obstructions.size());
  std::iota(all.begin(), all.end(), 0u);
  PointView view(tolerance);
  const PointView::Factors f = view.factors(eye, up, source, obstructions, all);
  CHECK(f.unobstructed == doctest::Approx(form_factor(eye, up, source)).epsilon(1e-14));
  return f.visible;
}

double factor(double x0, double y0, double x1, double y1) { return form_factor(eye, up, rectangle(x0, y0, x1, y1, 2)); }

}  // namespace

TEST_SUITE("point_view") {
  TEST_CASE("point_view: a shadow takes its own form factor away") {
    const double whole = form_factor(eye, up, source);
    CHECK(visible({}) == doctest::Approx(whole).epsilon(1e-14));
    CHECK(std::abs(visible({hiding(-0.5, 0, 0.2, 0.7)}) - (whole - factor(-0.5, 0, 0.2, 0.7))) < rounding);
    // Over a side, over a corner, beside.
    CHECK(std::abs(visible({hiding(0.5, -0.5, 3, 0.5)}) - (whole - factor(0.5, -0.5, 1, 0.5))) < rounding);
    CHECK(std::abs(visible({hiding(0.5, 0.5, 3, 3)}) - (whole - factor(0.5, 0.5, 1, 1))) < rounding);
    CHECK(std::abs(visible({hiding(1, -1, 3, 1)}) - whole) < rounding);
    CHECK(visible({hiding(-1, -1, 1, 1)}) < rounding);
  }

  TEST_CASE("point_view: shadows that overlap count once, those that meet leave no gap") {
    const double whole = form_factor(eye, up, source);
    const double united = factor(-0.5, -0.5, 0.5, 0.5) + factor(0, 0, 1, 1) - factor(0, 0, 0.5, 0.5);
    CHECK(std::abs(visible({hiding(-0.5, -0.5, 0.5, 0.5), hiding(0, 0, 1, 1)}) - (whole - united)) < rounding);
    CHECK(visible({hiding(-1, -1, 0.1, 1), hiding(0.1, -1, 1, 0.3), hiding(0.1, 0.3, 1, 1)}) < rounding);
  }

  TEST_CASE("point_view: an obstruction seen edge on hides nothing, turned over it hides as much") {
    const Obstruction edge_on =
        obstruction({{0.3, 0.4, 0.5}, {0.3, 0.4, 1}, {0.8, 0.9, 1}}, glm::normalize(Vec3{1, -1, 0}));
    CHECK(std::abs(visible({edge_on}) - form_factor(eye, up, source)) < rounding);
    const Obstruction one = hiding(-0.5, 0, 0.2, 0.7);
    const Obstruction turned = obstruction(Polygon(one.corners.rbegin(), one.corners.rend()), -one.planes[0].normal);
    CHECK(std::abs(visible({one}) - visible({turned})) < rounding);
  }

  TEST_CASE("point_view: many shadows in any order leave what points count") {
    Random random(7);
    std::vector<Obstruction> obstructions;
    std::vector<std::array<double, 4>> shadows;
    for (int k = 0; k < 12; ++k) {
      const double x = 2.4 * random.unit() - 1.4, y = 2.4 * random.unit() - 1.4;
      shadows.push_back({x, y, x + 0.6 * random.unit(), y + 0.6 * random.unit()});
      obstructions.push_back(hiding(shadows[k][0], shadows[k][1], shadows[k][2], shadows[k][3]));
    }
    const double exact = visible(obstructions);
    std::reverse(obstructions.begin(), obstructions.end());
    CHECK(std::abs(visible(obstructions) - exact) < rounding);
    // Midpoints of a grid; its error is a few squares along the shadows' borders.
    constexpr int n = 1000;
    double counted = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double x = -1 + (2 * i + 1.0) / n, y = -1 + (2 * j + 1.0) / n;
        if (std::any_of(shadows.begin(), shadows.end(),
                        [&](const std::array<double, 4>& s) { return x > s[0] && x < s[2] && y > s[1] && y < s[3]; }))
          continue;
        const Vec3 d = Vec3{x, y, 2} - eye;
        counted += d.z * d.z / (3.14159265358979 * glm::dot(d, d) * glm::dot(d, d)) * 4 / (n * n);
      }
    CHECK(counted == doctest::Approx(exact).epsilon(1e-3));
  }
}
