#include "core/tracing/ray_guide.hpp"

#include <doctest/doctest.h>

#include "core/base/random.hpp"

using namespace lichthof;

namespace {
/// Rays everywhere, of which those on a line x = 0.37 see something.
RayGuide line_guide() {
  std::vector<RayGuide::Found> found;
  for (std::uint32_t i = 0; i < 1024; ++i) {
    const Vec2 square = r2_point(i, {0, 0});
    found.push_back({square, std::abs(square.x - 0.37) < 0.01 ? 100.0 : 0.0, 1.0});
  }
  return RayGuide(found, 0.5);
}
}  // namespace

TEST_CASE("ray_guide: square_of_direction is the inverse of cosine_direction") {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Vec2 square = r2_point(i, {0, 0}), back = square_of_direction(cosine_direction(square));
    CHECK(std::abs(back.x - square.x) + std::abs(back.y - square.y) < 1e-9);
  }
  CHECK(square_of_direction({0, 0, 1}) == Vec2{0.5, 0.5});
}

TEST_CASE("ray_guide: places are as dense as it says, and every part of the square keeps some") {
  const RayGuide guide = line_guide();
  REQUIRE(!guide.is_uniform());
  double area = 0, left = 0, on_line = 0;
  constexpr std::uint32_t count = 1 << 14;
  for (std::uint32_t i = 0; i < count; ++i) {
    double density = 0;
    const Vec2 place = guide.warped(r2_point(i, {0, 0}), density);
    CHECK(density == guide.density(place));
    CHECK(density >= 0.29);
    area += 1 / density / count;
    if (place.x < 0.25) left += 1 / density / count;
    on_line += std::abs(place.x - 0.37) < 0.01;
  }
  CHECK(area == doctest::Approx(1).epsilon(0.01));
  CHECK(left == doctest::Approx(0.25).epsilon(0.02));
  CHECK(on_line / count > 5 * 0.02);
}

TEST_CASE("ray_guide: what has seen nothing guides nowhere") {
  CHECK(RayGuide().is_uniform());
  const std::vector<RayGuide::Found> dark(64, {{0.5, 0.5}, 0.0, 1.0});
  CHECK(RayGuide(dark, 0.5).is_uniform());
}
