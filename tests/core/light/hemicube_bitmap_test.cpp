#include "core/light/hemicube_bitmap.hpp"

#include <doctest/doctest.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/light/bit_projector.hpp"
#include "tests/support/hemicube_reference.hpp"

using namespace lichthof;
using reference::random_frame;
using reference::random_polygon;
using reference::random_unit;
using reference::upright_frame;

namespace {

HemicubeBitmap full(std::uint32_t resolution) {
  HemicubeBitmap bitmap(resolution);
  bitmap.cover_run(0, pixel_count(resolution));
  return bitmap;
}

/// Every pixel by the toss of a coin.
HemicubeBitmap noise(std::uint32_t resolution, Random& random, double share) {
  HemicubeBitmap bitmap(resolution);
  for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
    if (random.unit() < share) bitmap.cover(pixel);
  }
  return bitmap;
}

/// What a cell would send: the shadows of some polygons.
HemicubeBitmap shadows(std::uint32_t resolution, Random& random, int count, double size) {
  HemicubeBitmap bitmap(resolution);
  const HemicubeFrame frame = random_frame(random, {0, 0, 0});
  for (int i = 0; i < count; ++i) project(frame, random_polygon(random, 2.0 * random_unit(random), size, 1.0), bitmap);
  return bitmap;
}

/// Bilinear look-up as the header words it, in double precision.
double reference_visibility(const HemicubeBitmap& bitmap, const Vec3& d) {
  const std::uint32_t resolution = bitmap.resolution(), pixel = pixel_of(d, resolution);
  std::uint32_t face = 0;
  while (face + 1 < face_count && pixel >= first_pixel_of(face + 1, resolution)) ++face;
  const Vec3 p = face_coordinates(face, d);
  const double half = 0.5 * resolution, rows = face_rows(face, resolution);
  const double column = std::clamp((p.x / p.z + 1) * half - 0.5, 0.0, resolution - 1.0);
  const double row = std::clamp((p.y / p.z + (face == 0)) * half - 0.5, 0.0, rows - 1.0);
  double sum = 0;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < resolution; ++c) {
      const double weight = std::max(0.0, 1 - std::abs(column - c)) * std::max(0.0, 1 - std::abs(row - r));
      if (!bitmap.covered(first_pixel_of(face, resolution) + r * resolution + c)) sum += weight;
    }
  }
  return sum;
}

Vec3 point_in(const Box& box, Random& random) {
  return box.lo + Vec3{random.unit(), random.unit(), random.unit()} * box.size();
}

constexpr std::uint32_t resolutions[] = {8, 10, 30, 62, 64, 66, 100, 128, 256, 1024};

}  // namespace

TEST_CASE("hemicube_bitmap: runs cover and ask for exactly their pixels") {
  Random random(1);
  for (const std::uint32_t resolution : {8u, 10u, 64u}) {
    std::uint32_t wrong = 0;
    for (int i = 0; i < 500; ++i) {
      std::uint32_t first = random.below(pixel_count(resolution) + 1), end = random.below(pixel_count(resolution) + 1);
      if (i % 2) end = std::min(first + random.below(70), pixel_count(resolution));
      HemicubeBitmap bitmap(resolution);
      bitmap.cover_run(first, end);
      for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
        wrong += bitmap.covered(pixel) != (pixel >= first && pixel < end);
      }
      wrong += bitmap.covered_count() != (end > first ? end - first : 0);
      wrong += !bitmap.covered_run(first, end);
      if (first < end) {
        wrong += first > 0 && bitmap.covered_run(first - 1, end);
        wrong += end < pixel_count(resolution) && bitmap.covered_run(first, end + 1);
      }
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("hemicube_bitmap: merging is the or of every pixel") {
  Random random(2);
  const HemicubeBitmap a = noise(30, random, 0.3), b = noise(30, random, 0.3);
  HemicubeBitmap both = a, other = b;
  both.merge(b);
  other.merge(a);
  CHECK(both == other);
  for (std::uint32_t pixel = 0; pixel < pixel_count(30); ++pixel) {
    REQUIRE(both.covered(pixel) == (a.covered(pixel) || b.covered(pixel)));
  }
}

TEST_CASE("hemicube_bitmap: at a pixel's centre that pixel alone is seen") {
  Random random(3);
  for (const std::uint32_t resolution : {8u, 10u, 128u}) {
    const HemicubeBitmap bitmap = noise(resolution, random, 0.5);
    double worst = 0;
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); ++pixel) {
      const double seen = bitmap.visibility(3.7 * pixel_direction(pixel, resolution));
      worst = std::max(worst, std::abs(seen - (bitmap.covered(pixel) ? 0.0 : 1.0)));
    }
    CHECK(worst < 1e-4);
  }
}

TEST_CASE("hemicube_bitmap: visibility is bilinear between pixel centres of one face, and constant beyond them") {
  Random random(4);
  // Single precision places a direction within 1e-6 of the face's half width: 1e-5 pixels here.
  constexpr double rounding = 1e-4;
  for (const std::uint32_t resolution : {8u, 18u}) {
    const HemicubeBitmap bitmap = noise(resolution, random, 0.5);
    double worst = 0;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 d = cosine_direction({random.unit(), random.unit()}) + Vec3{0, 0, 1e-6};
      const Vec3 sizes = glm::abs(d);
      const double gap = std::min({std::abs(sizes.x - sizes.y), std::abs(sizes.x - d.z), std::abs(sizes.y - d.z)});
      if (gap < 1e-5) continue;  // on the edge of two faces rounding chooses
      worst = std::max(worst, std::abs(bitmap.visibility(d) - reference_visibility(bitmap, d)));
    }
    CHECK(worst < rounding);
  }
}

TEST_CASE("hemicube_bitmap: an edge between two pixels is seen half from its middle") {
  HemicubeBitmap bitmap(8);
  bitmap.cover_run(0, 4), bitmap.cover_run(8, 12), bitmap.cover_run(16, 20);  // columns 0..3 of rows 0..2
  CHECK(bitmap.visibility({0, -0.875, 1}) == doctest::Approx(0.5f));
  CHECK(bitmap.visibility({-0.125, -0.25, 1}) == doctest::Approx(0.5f));
  CHECK(bitmap.visibility({0, -0.25, 1}) == doctest::Approx(0.75f));
  CHECK(bitmap.visibility({-0.999, -0.999, 1}) == 0.f);
}

TEST_CASE("hemicube_bitmap: 16 look-ups are the same bits as one") {
  Random random(5);
  const HemicubeBitmap bitmap = noise(62, random, 0.5);
  std::uint32_t wrong = 0;
  for (int i = 0; i < 2000; ++i) {
    float x[16], y[16], z[16], seen[16];
    for (int k = 0; k < 16; ++k) {
      const Vec3 d = std::pow(10.0, 6 * random.unit() - 3) * random_unit(random);
      x[k] = static_cast<float>(d.x), y[k] = static_cast<float>(d.y), z[k] = static_cast<float>(d.z);
    }
    bitmap.visibility16(x, y, z, seen);
    for (int k = 0; k < 16; ++k) {
      wrong += seen[k] != bitmap.visibility({x[k], y[k], z[k]}) || !(seen[k] >= 0.f && seen[k] <= 1.f);
      wrong += z[k] <= 0.f && seen[k] != 0.f;
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("hemicube_bitmap: odd directions are seen somewhere between 0 and 1, or below the base plane not at all") {
  const HemicubeBitmap bitmap(64);
  const float odd[] = {0.f,
                       -0.f,
                       1.f,
                       -1.f,
                       1e-38f,
                       1e-45f,
                       -3e38f,
                       3e38f,
                       std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN()};
  for (const float x : odd) {
    for (const float y : odd) {
      for (const float z : odd) {
        const float seen = bitmap.visibility({x, y, z});
        CHECK(seen == (z > 0.f ? 1.f : 0.f));  // nothing is covered, so wherever the look-up goes
      }
    }
  }
}

TEST_CASE("hemicube_bitmap: the wire form comes back bit by bit at every resolution") {
  Random random(6);
  for (const std::uint32_t resolution : resolutions) {
    for (const HemicubeBitmap& bitmap :
         {HemicubeBitmap(resolution), full(resolution), noise(resolution, random, 0.5), noise(resolution, random, 0.01),
          shadows(resolution, random, 3, 0.5), shadows(resolution, random, 40, 0.3)}) {
      const std::vector<std::uint8_t> bytes = packed(bitmap);
      const Expected<HemicubeBitmap> back = unpacked(bytes);
      REQUIRE(back);
      CHECK(*back == bitmap);
      CHECK(bytes.size() <= 8 * bitmap.words().size() + 64);  // never much more than the words
    }
  }
}

TEST_CASE("hemicube_bitmap: single pixels and single free pixels come back") {
  for (const std::uint32_t resolution : {8u, 10u, 62u, 66u}) {
    std::uint32_t wrong = 0;
    for (std::uint32_t pixel = 0; pixel < pixel_count(resolution); pixel += 1 + pixel / 50) {
      HemicubeBitmap one(resolution), others(resolution);
      one.cover(pixel);
      others.cover_run(0, pixel), others.cover_run(pixel + 1, pixel_count(resolution));
      const Expected<HemicubeBitmap> a = unpacked(packed(one)), b = unpacked(packed(others));
      wrong += !a || !(*a == one) || !b || !(*b == others);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("hemicube_bitmap: truncated, lengthened and foreign bytes are refused") {
  Random random(7);
  const std::vector<std::uint8_t> good = packed(shadows(128, random, 20, 0.5));
  for (std::size_t size = 0; size < good.size(); ++size) {
    const Expected<HemicubeBitmap> bitmap = unpacked({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)});
    REQUIRE_FALSE(bitmap);
    CHECK(bitmap.error().code == ErrorCode::bad_input);
  }
  std::vector<std::uint8_t> longer = good;
  longer.push_back(0);
  CHECK_FALSE(unpacked(longer));
  for (const std::uint32_t resolution : {0u, 2u, 6u, 9u, 127u, 126u, 256u, 1025u, 1026u, 65535u}) {
    std::vector<std::uint8_t> other = good;
    other[0] = static_cast<std::uint8_t>(resolution), other[1] = static_cast<std::uint8_t>(resolution >> 8);
    CHECK_FALSE(unpacked(other));
  }
}

TEST_CASE("hemicube_bitmap: damaged bytes give an error or a bitmap, and nothing else") {
  Random random(8);
  std::uint32_t accepted = 0;
  for (const std::uint32_t resolution : {8u, 10u, 64u, 128u}) {
    const std::vector<std::uint8_t> good = packed(shadows(resolution, random, 10, 0.7));
    for (int i = 0; i < 5000; ++i) {
      std::vector<std::uint8_t> bad = good;
      for (std::uint32_t k = random.below(3) + 1; k > 0; --k) {
        bad[random.below(static_cast<std::uint32_t>(bad.size()))] = static_cast<std::uint8_t>(random.bits());
      }
      const Expected<HemicubeBitmap> bitmap = unpacked(bad);
      if (!bitmap) continue;
      ++accepted;
      REQUIRE(bitmap->covered_count() <= pixel_count(bitmap->resolution()));  // the padding stays 0
      const Expected<HemicubeBitmap> again = unpacked(packed(*bitmap));
      REQUIRE(again);
      REQUIRE(*again == *bitmap);
    }
  }
  CHECK(accepted > 0);
}

TEST_CASE("hemicube_bitmap: hostile frames with a valid header are refused, however much they promise") {
  const auto message = [](std::uint32_t resolution, const std::vector<std::uint8_t>& content) {
    std::vector<std::uint8_t> bytes(6 + ZSTD_compressBound(content.size()));
    const std::size_t length = ZSTD_compress(bytes.data() + 6, bytes.size() - 6, content.data(), content.size(), 1);
    bytes.resize(6 + length);
    bytes[0] = static_cast<std::uint8_t>(resolution), bytes[1] = static_cast<std::uint8_t>(resolution >> 8);
    for (std::size_t i = 0; i < 4; ++i) bytes[2 + i] = static_cast<std::uint8_t>(length >> (8 * i));
    return bytes;
  };
  const auto words = [](std::size_t count, std::uint8_t value) { return std::vector<std::uint8_t>(count, value); };
  CHECK(unpacked(message(8, words(24, 255))));                        // 192 pixels as words
  CHECK(unpacked(message(8, {0xc0, 0x01})));                          // one run of 192 free pixels
  CHECK(unpacked(message(8, {0, 0xc0, 0x01})));                       // one of 192 covered ones
  CHECK_FALSE(unpacked(message(8, words(25, 255))));                  // longer than the words
  CHECK_FALSE(unpacked(message(8, words(50'000'000, 0))));            // a bomb: 1.5 KB that unfold to 50 MB
  CHECK_FALSE(unpacked(message(8, {})));                              // no runs
  CHECK_FALSE(unpacked(message(8, {0xbf, 0x01})));                    // one pixel short
  CHECK_FALSE(unpacked(message(8, {0xc1, 0x01})));                    // one too many
  CHECK_FALSE(unpacked(message(8, {0xc0})));                          // ends inside a number
  CHECK_FALSE(unpacked(message(8, {0xff, 0xff, 0xff, 0xff, 0x7f})));  // a number without end
  CHECK_FALSE(unpacked(message(10, words(40, 255))));                 // covers the padding behind pixel 299
  // Two frames, and a frame that does not tell its size, are no bitmap either.
  std::vector<std::uint8_t> twice = message(8, words(24, 0));
  const std::size_t length = twice.size() - 6;
  twice.insert(twice.end(), twice.begin() + 6, twice.end());
  twice[2] = static_cast<std::uint8_t>(2 * length);
  CHECK_FALSE(unpacked(twice));
}

TEST_CASE("hemicube_bitmap: a box behind the base plane is covered, one around the centre never") {
  Random random(9);
  const HemicubeBitmap nothing(64), everything = full(64);
  const HemicubeFrame frame = upright_frame({1, 2, 3});
  CHECK(nothing.covers(frame, {{0, 0, 0}, {5, 5, 2.9}}));
  CHECK(nothing.covers(frame, {{0, 0, 0}, {5, 5, 3}}));  // touches it
  CHECK_FALSE(nothing.covers(frame, {{2, 0, 0}, {5, 5, 3.1}}));
  CHECK(everything.covers(frame, {{2, 0, 0}, {5, 5, 3.1}}));
  CHECK(everything.covers(frame, {{-50, -50, 3.1}, {50, 50, 90}}));
  CHECK_FALSE(everything.covers(frame, {{0, 0, 0}, {5, 5, 5}}));
  CHECK_FALSE(everything.covers(frame, {{1, 2, 3}, {5, 5, 5}}));  // a corner at the centre
  CHECK_FALSE(everything.covers(frame, {{-1e300, -1e300, -1e300}, {1e300, 1e300, 1e300}}));
  CHECK(nothing.covers(frame, Box{}));                         // an empty box holds nothing to be lit
  CHECK_FALSE(nothing.covers(frame, {{4, 4, 4}, {4, 4, 4}}));  // a single point
  CHECK(everything.covers(frame, {{4, 4, 4}, {4, 4, 4}}));
}

TEST_CASE("hemicube_bitmap: no point of a covered box is visible") {
  Random random(10);
  std::uint32_t covered = 0, wrong = 0;
  for (int i = 0; i < 6000; ++i) {
    const std::uint32_t resolution = i % 2 ? 32 : 128;
    const HemicubeFrame frame = random_frame(random, {1, 2, 3});
    HemicubeBitmap bitmap(resolution);
    for (int k = 0; k < 6; ++k)
      project(frame, random_polygon(random, frame.centre + random_unit(random), 1.0, 1.0), bitmap);
    const Vec3 lo = frame.centre + (0.3 + 3 * random.unit()) * random_unit(random);
    const Box box{lo, lo + std::pow(10.0, -2 + 2 * random.unit()) *
                               Vec3{random.unit(), random.unit(), i % 7 ? random.unit() : 0.0}};
    if (!bitmap.covers(frame, box)) continue;
    covered += box.contains(frame.centre) ? 0 : 1;
    for (int k = 0; k < 400; ++k) {
      // Corners and sides of the box are where a silhouette is missed first.
      Vec3 point = point_in(box, random);
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t choice = random.below(4);
        if (choice < 2) point[axis] = choice ? box.hi[axis] : box.lo[axis];
      }
      wrong += bitmap.visibility(frame.to_local(point - frame.centre)) > 0.f;
    }
  }
  CHECK(covered > 1000);
  CHECK(wrong == 0);
}

TEST_CASE("hemicube_bitmap: a box is covered when all pixels around its projection are") {
  // The other direction: with only one pixel free, a box that stays two pixels away from it must be covered.
  Random random(11);
  constexpr std::uint32_t resolution = 64;
  std::uint32_t far = 0, wrong = 0;
  for (int i = 0; i < 3000; ++i) {
    const HemicubeFrame frame = random_frame(random, {1, 2, 3});
    const Vec3 lo = frame.centre + 2.0 * random_unit(random);
    const Box box{lo, lo + Vec3{random.unit(), random.unit(), random.unit()}};
    if (box.contains(frame.centre, 0.01)) continue;
    const std::uint32_t free = random.below(pixel_count(resolution));
    HemicubeBitmap bitmap(resolution);
    bitmap.cover_run(0, free), bitmap.cover_run(free + 1, pixel_count(resolution));
    // Angle between the free pixel and the nearest of many points of the box.
    const Vec3 d = glm::normalize(pixel_direction(free, resolution));
    double nearest = -1;
    for (int k = 0; k < 3000; ++k) {
      nearest = std::max(nearest, glm::dot(d, glm::normalize(frame.to_local(point_in(box, random) - frame.centre))));
    }
    if (nearest > std::cos(0.2))
      continue;  // pixels are 1/32 wide: this is some six of them, and the sampling is coarse
    ++far;
    wrong += !bitmap.covers(frame, box);
  }
  CHECK(far > 500);
  CHECK(wrong == 0);
}
