#include "bench/frontier.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lichthof;
using namespace lichthof::bench;

namespace {
constexpr double rounding = 1e-12;  // a few operations in double
}

TEST_SUITE("bench") {
  TEST_CASE("frontier: a run that another one equals or beats in both is not on it") {
    //                             slow, best    quick, bad   beaten by both  equal to the first  quick, worse
    const std::vector<CostError> runs{{8, .01}, {1, .10}, {9, .10}, {8, .01}, {1, .20}, {3, .05}};
    CHECK(frontier(runs) == std::vector<std::size_t>{1, 5, 0});
    CHECK(frontier({}).empty());
  }

  TEST_CASE("frontier: an exponent comes out of a power law, and of one with noise by least squares") {
    std::vector<Vec2> points;
    for (const double n : {5e3, 1e4, 2e4, 4e4}) points.push_back({n, 3e-7 * std::pow(n, 1.15)});
    CHECK(log_log_slope(points) == doctest::Approx(1.15).epsilon(rounding));
    // Equal factors up and down at the inner two leave this slope: x = -3, -1, 1, 3 and y = 0, +d, -d, 0 by themselves.
    const double d = std::log(1.1), step = std::log(2.0) / 2;
    points[1].y *= 1.1, points[2].y /= 1.1;
    CHECK(log_log_slope(points) == doctest::Approx(1.15 - 2 * d / (20 * step)).epsilon(rounding));
  }

  TEST_CASE("frontier: path tracing needs four times the time for half the error") {
    const std::vector<CostError> runs{{1, .08}, {4, .04}, {16, .02}};
    const SquareRootLaw law(runs);
    CHECK(law.cpu_s(.08) == doctest::Approx(1).epsilon(rounding));
    CHECK(law.cpu_s(.01) == doctest::Approx(64).epsilon(rounding));
    CHECK(law.error(64) == doctest::Approx(.01).epsilon(rounding));
    // Runs that disagree count alike, by their logarithms.
    const std::vector<CostError> two{{1, .02}, {1, .08}};
    CHECK(SquareRootLaw(two).error(1) == doctest::Approx(.04).epsilon(rounding));
  }
}
