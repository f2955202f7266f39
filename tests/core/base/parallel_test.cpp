#include "core/base/parallel.hpp"

#include <doctest/doctest.h>

#include <vector>

using namespace lichthof;

TEST_SUITE("parallel") {
  TEST_CASE("parallel: every index is called once, with any number of threads") {
    for (const unsigned threads : {1u, 2u, 5u}) {
      const Parallel parallel(threads);
      CHECK(parallel.threads() == threads);
      for (const std::size_t count : {0u, 1u, 2u, 17u, 1000u}) {
        std::vector<int> calls(count, 0);
        parallel.for_each(count, [&](std::size_t i) { ++calls[i]; });
        CHECK(calls == std::vector<int>(count, 1));
      }
    }
  }

  TEST_CASE("parallel: one arena serves many steps, and steps may nest") {
    const Parallel parallel(2);
    std::vector<std::vector<int>> calls(20, std::vector<int>(30, 0));
    for (int step = 0; step < 50; ++step)
      parallel.for_each(20, [&](std::size_t i) { parallel.for_each(30, [&](std::size_t k) { ++calls[i][k]; }); });
    for (const auto& row : calls) CHECK(row == std::vector<int>(30, 50));
  }
}
