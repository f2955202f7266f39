#include "core/light/hemicube.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;

namespace {
constexpr std::uint32_t resolutions[] = {8, 10, 30, 64, 128};
}

TEST_CASE("hemicube: delta form factors sum to one, with the midpoint's error of 0.54 pixel areas") {
  for (const std::uint32_t resolution : {8u, 16u, 62u, 128u, 256u}) {
    double sum = 0, smallest = 1;
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
      sum += delta_form_factor(pixel, resolution);
      smallest = std::min(smallest, delta_form_factor(pixel, resolution));
    }
    CHECK(sum == doctest::Approx(1.0 + 0.542 / (resolution * resolution)).epsilon(0.01 / (resolution * resolution)));
    CHECK(smallest > 0.0);
  }
}

TEST_CASE("hemicube: the faces share the hemisphere as the closed form says") {
  // Point below the middle of a parallel square of side 2 at distance 1: F = 4/π · sqrt(½) · atan(sqrt(½)).
  const double top = 4.0 / std::numbers::pi * std::sqrt(0.5) * std::atan(std::sqrt(0.5));
  constexpr std::uint32_t resolution = 256;
  double sum[face_count] = {};
  for (std::uint32_t face = 0; face < face_count; ++face) {
    const std::uint32_t first = first_pixel_of(face, resolution);
    const std::uint32_t count = face_rows(face, resolution) * resolution;
    for (std::uint32_t pixel = first; pixel < first + count; ++pixel) sum[face] += delta_form_factor(pixel, resolution);
  }
  constexpr double midpoint_error = 1e-5;  // of R = 256
  CHECK(sum[0] == doctest::Approx(top).epsilon(midpoint_error));
  for (std::uint32_t face = 1; face < face_count; ++face) {
    CHECK(sum[face] == doctest::Approx((1 - top) / 4).epsilon(4 * midpoint_error));
  }
}

TEST_CASE("hemicube: every pixel is found again by its centre direction, of any length") {
  for (const std::uint32_t resolution : resolutions) {
    std::uint32_t wrong = 0;
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
      const Vec3 d = pixel_direction(pixel, resolution);
      wrong += pixel_of(d, resolution) != pixel || pixel_of(1e-20 * d, resolution) != pixel ||
               pixel_of(1e20 * d, resolution) != pixel;
      wrong += std::max({std::abs(d.x), std::abs(d.y), d.z}) != 1.0 || d.z <= 0.0;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("hemicube: columns and rows run as the header says") {
  constexpr std::uint32_t n = 8;
  CHECK(pixel_direction(0, n) == Vec3{-0.875, -0.875, 1});
  CHECK(pixel_direction(1, n) == Vec3{-0.625, -0.875, 1});
  CHECK(pixel_direction(n, n) == Vec3{-0.875, -0.625, 1});
  CHECK(pixel_direction(first_pixel_of(1, n), n) == Vec3{1, -0.875, 0.125});
  CHECK(pixel_direction(first_pixel_of(1, n) + 1, n) == Vec3{1, -0.625, 0.125});
  CHECK(pixel_direction(first_pixel_of(1, n) + n, n) == Vec3{1, -0.875, 0.375});
  CHECK(pixel_direction(first_pixel_of(2, n), n) == Vec3{0.875, 1, 0.125});
  CHECK(pixel_direction(first_pixel_of(3, n), n) == Vec3{-1, 0.875, 0.125});
  CHECK(pixel_direction(first_pixel_of(4, n), n) == Vec3{-0.875, -1, 0.125});
  CHECK(first_pixel_of(4, n) + n * n / 2 == pixel_count(n));
}

TEST_CASE("hemicube: face coordinates are those of the pixel centres") {
  for (std::uint32_t face = 0; face < face_count; ++face) {
    const std::uint32_t pixel = first_pixel_of(face, 8) + 2 * 8 + 5;  // row 2, column 5
    const Vec3 p = face_coordinates(face, pixel_direction(pixel, 8));
    CHECK(p == Vec3{0.375, face == 0 ? -0.375 : 0.625, 1});
  }
}

TEST_CASE("hemicube: a direction falls into the pixel whose square it passes") {
  Random random(1);
  for (const std::uint32_t resolution : resolutions) {
    std::uint32_t wrong = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 d = cosine_direction({random.unit(), random.unit()});
      const std::uint32_t pixel = pixel_of(d, resolution);
      const Vec3 centre = pixel_direction(pixel, resolution);
      std::uint32_t face = 0;
      while (face + 1 < face_count && pixel >= first_pixel_of(face + 1, resolution)) ++face;
      const Vec3 p = face_coordinates(face, d), c = face_coordinates(face, centre);
      const double half_pixel = 1.0 / resolution + 1e-12;
      wrong += !(p.z > 0) || std::abs(p.x / p.z - c.x) > half_pixel || std::abs(p.y / p.z - c.y) > half_pixel;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("hemicube: no direction leaves the hemicube") {
  const double odd[] = {0.0,
                        -0.0,
                        1.0,
                        -1.0,
                        1e-300,
                        -1e300,
                        1e300,
                        std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::quiet_NaN()};
  for (const double x : odd) {
    for (const double y : odd) {
      for (const double z : odd) CHECK(pixel_of({x, y, z}, 64) < pixel_count(64));
    }
  }
}

TEST_CASE("hemicube: the frame turns vectors there and back") {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const HemicubeFrame frame = reference::random_frame(random, {1, 2, 3});
    const Vec3 v = reference::random_unit(random);
    CHECK(glm::length(frame.to_world(frame.to_local(v)) - v) < 1e-14);
    CHECK(frame.to_local(frame.normal).z == doctest::Approx(1));
  }
}
