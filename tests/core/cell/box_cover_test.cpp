#include "core/cell/box_cover.hpp"

#include <doctest/doctest.h>

#include <array>

#include "core/light/bit_projector.hpp"

using namespace lichthof;

namespace {
constexpr std::uint32_t resolution = 64;
const HemicubeFrame frame{{0.3, 0.4, 0.5}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
const Box next_cell{{1, 0, 0}, {2, 1, 1}};

HemicubeBitmap behind_wall(double y_lo, double y_hi) {
  HemicubeBitmap bitmap(resolution);
  project(frame, std::array<Vec3, 4>{Vec3{1, y_lo, 0}, Vec3{1, y_hi, 0}, Vec3{1, y_hi, 1}, Vec3{1, y_lo, 1}}, bitmap);
  return bitmap;
}
}  // namespace

TEST_SUITE("box_cover") {
  TEST_CASE("box_cover: a wall that fills the side of a box hides it, exactly to its edges") {
    CHECK(hides(behind_wall(0, 1), frame, next_cell));
    CHECK(hides(behind_wall(-1, 2), frame, next_cell));
    CHECK(!hides(behind_wall(0.1, 1), frame, next_cell));
    CHECK(!hides(behind_wall(0, 0.9), frame, next_cell));
    CHECK(!hides(HemicubeBitmap(resolution), frame, next_cell));
  }

  TEST_CASE("box_cover: one free pixel within the outline is enough to be seen") {
    const HemicubeBitmap wall = behind_wall(0, 1);
    for (const Vec3& direction : {Vec3{1, 0.1, 0.1}, Vec3{1, -0.5, 0.6}}) {
      HemicubeBitmap holed(resolution);
      const std::uint32_t hole = pixel_of(frame.to_local(direction), resolution);
      for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel)
        if (wall.covered(pixel) && pixel != hole) holed.cover(pixel);
      CHECK(!hides(holed, frame, next_cell));
    }
  }

  TEST_CASE("box_cover: boxes around the centre are never hidden, boxes behind the base plane always are") {
    HemicubeBitmap full(resolution);
    full.cover_run(0, pixel_count(resolution));
    CHECK(!hides(full, frame, Box{{0, 0, 0}, {1, 1, 1}}));
    CHECK(hides(HemicubeBitmap(resolution), frame, Box{{-2, 0, 0}, {-1, 1, 1}}));
  }

  TEST_CASE("box_cover: a box smaller than a pixel is hidden only when the filter sees nothing of it") {
    const Box far_away{{500, 0.4, 0.5}, {500.1, 0.5, 0.6}};
    HemicubeBitmap full(resolution);
    full.cover_run(0, pixel_count(resolution));
    CHECK(hides(full, frame, far_away));
    CHECK(!hides(HemicubeBitmap(resolution), frame, far_away));
  }
}
