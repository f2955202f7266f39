#include "core/base/random.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <set>

using namespace lichthof;

TEST_SUITE("random") {
  TEST_CASE("random: the bits are the same on every machine") {
    // From an independent implementation with integers of any length.
    Random a(42), b(42, 7);
    for (const std::uint32_t expected : {0xccfe45fcu, 0x61157d5eu, 0x68e11cdbu, 0xab48faa0u}) CHECK(a.bits() == expected);
    for (const std::uint32_t expected : {0x8de2226bu, 0x12bcde03u, 0xe71ddf8au, 0xc0d53d07u}) CHECK(b.bits() == expected);
    CHECK(mix64(0) == 0xe220a8397b1dcdafull);
    CHECK(mix64(1) == 0x910a2dec89025cc1ull);
  }

  TEST_CASE("random: seeds and streams differ, copies agree") {
    std::set<std::uint32_t> first;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
      for (std::uint64_t stream = 0; stream < 10; ++stream) first.insert(Random(seed, stream).bits());
    CHECK(first.size() == 1000);
    Random a(5);
    a.bits();
    Random b = a;
    for (int k = 0; k < 10; ++k) CHECK(a.bits() == b.bits());
  }

  TEST_CASE("random: unit and below are uniform and stay in their ranges") {
    Random random(3);
    double sum = 0, squares = 0;
    int counts[7] = {};
    constexpr int draws = 70000;
    for (int k = 0; k < draws; ++k) {
      const double u = random.unit();
      REQUIRE((u >= 0 && u < 1));
      sum += u, squares += u * u;
      const std::uint32_t i = random.below(7);
      REQUIRE(i < 7);
      ++counts[i];
    }
    CHECK(std::abs(sum / draws - 0.5) < 5 * std::sqrt(1.0 / 12 / draws));
    CHECK(std::abs(squares / draws - 1.0 / 3) < 5 * std::sqrt(4.0 / 45 / draws));
    for (const int count : counts) CHECK(std::abs(count - 10000) < 5 * 100);
    CHECK(random.below(1) == 0);
  }

  TEST_CASE("random: r2 points are low in discrepancy and stay in the square") {
    constexpr int side = 16, points = 16 * side * side;
    int counts[side][side] = {};
    for (std::uint32_t k = 0; k < points; ++k) {
      const Vec2 p = r2_point(k, {0.3, 0.9});
      REQUIRE((p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1));
      ++counts[static_cast<int>(p.x * side)][static_cast<int>(p.y * side)];
    }
    for (const auto& row : counts)
      for (const int count : row) CHECK(std::abs(count - 16) <= 6);  // chance alone would stray by 16
  }

  TEST_CASE("random: cosine directions are unit, above the plane, and follow the cosine") {
    Random random(8);
    Vec3 sum{0.0};
    constexpr int draws = 40000;
    for (int k = 0; k < draws; ++k) {
      const Vec3 d = cosine_direction({random.unit(), random.unit()});
      REQUIRE(glm::length(d) == doctest::Approx(1).epsilon(1e-12));
      REQUIRE(d.z >= 0);
      sum += d;
    }
    CHECK(sum.z / draws == doctest::Approx(2.0 / 3).epsilon(0.01));
    CHECK(std::abs(sum.x / draws) < 0.02);
    CHECK(std::abs(sum.y / draws) < 0.02);
  }

  TEST_CASE("random: a frame is right-handed and orthonormal for every normal") {
    Random random(9);
    const auto check = [](const Vec3& n) {
      Vec3 t, b;
      complete_frame(n, t, b);
      CHECK(glm::length(glm::cross(t, b) - n) < 1e-12);
      CHECK(glm::length(t) == doctest::Approx(1).epsilon(1e-12));
      CHECK(std::abs(glm::dot(t, b)) < 1e-12);
    };
    for (int k = 0; k < 200; ++k)
      check(glm::normalize(Vec3{random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5}));
    for (const Vec3& n : {Vec3{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) check(n);
    check(glm::normalize(Vec3{1e-9, 0, -1}));
  }
}
