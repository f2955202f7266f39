#include "io/image_writer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

Image gradient(std::uint32_t width, std::uint32_t height) {
  Image image{width, height, {}};
  for (std::uint32_t i = 0; i < 3 * width * height; ++i) image.rgb.push_back(0.01f * static_cast<float>(i + 1));
  return image;
}

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("image_writer: exr keeps every float, hdr keeps its eight bits") {
    const ScratchFolder folder;
    const Image image = gradient(5, 3);
    REQUIRE(write_image(folder / "a.exr", image.view()));
    const auto exr = read_image(folder / "a.exr");
    REQUIRE(exr);
    CHECK(exr->width == 5);
    CHECK(exr->height == 3);
    CHECK(exr->rgb == image.rgb);
    REQUIRE(write_image(folder / "a.hdr", image.view()));
    const auto hdr = read_image(folder / "a.hdr");
    REQUIRE(hdr);
    REQUIRE(hdr->rgb.size() == image.rgb.size());
    // RGBE: 8 bits relative to the largest channel.
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
      CHECK(hdr->rgb[i] == doctest::Approx(image.rgb[i]).epsilon(0.02));
    CHECK(folder.names() == std::vector<std::string>{"a.exr", "a.hdr"});
  }

  TEST_CASE("image_writer: png shows a uniform picture as the filmic curve's middle grey") {
    const ScratchFolder folder;
    for (const float level : {1e-4f, 1.f, 1e4f}) {
      const Image image{2, 2, std::vector<float>(12, level)};
      REQUIRE(write_image(folder / "a.png", image.view()));
      const auto png = read_image(folder / "a.png");
      REQUIRE(png);
      // 0.18 (2.51 0.18 + 0.03) / (0.18 (2.43 0.18 + 0.59) + 0.14) = 0.26686, within half a step of 8-bit sRGB.
      for (const float value : png->rgb) CHECK(value == doctest::Approx(0.26686).epsilon(0.01));
    }
    const Image image{1, 1, {0.18f, 0.18f, 0.18f}};
    ToneMapping tone;
    tone.exposure_ev = 0;
    CHECK(exposure_factor(image.view(), tone) == 1);
    tone.exposure_ev = -2;
    CHECK(exposure_factor(image.view(), tone) == 0.25);
  }

  TEST_CASE("image_writer: black, infinite and NaN pixels neither crash nor count") {
    const ScratchFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const Image image{2, 2, {0, 0, 0, nan, 1, 1, inf, inf, inf, 0.5f, 0.5f, 0.5f}};
    CHECK(exposure_factor(image.view(), {}) == doctest::Approx(0.18 / 0.5));
    REQUIRE(write_image(folder / "a.png", image.view()));
    const auto png = read_image(folder / "a.png");
    REQUIRE(png);
    CHECK(png->rgb[0] == 0);
    CHECK(png->rgb[3] == 0);
    CHECK(png->rgb[6] == 1);
    const Image black{1, 1, {0, 0, 0}};
    CHECK(exposure_factor(black.view(), {}) == 1);
  }

  TEST_CASE("image_writer: the filmic curve rises from 0 to 1, and sRGB decodes what it encodes") {
    CHECK(filmic(0) == 0);
    CHECK(filmic(-1) == 0);
    CHECK(filmic(1e30) == 1);
    for (double x = 1e-4; x < 100; x *= 1.3) CHECK(filmic(1.3 * x) >= filmic(x));
    for (double x = 0; x <= 1; x += 0.01) CHECK(srgb_decoded(srgb_encoded(x)) == doctest::Approx(x));
  }

  TEST_CASE("image_writer: an unwritable output and a full disk are one clear line, nothing half-written") {
    const ScratchFolder folder;
    const Image image = gradient(4, 4);
    check_error(write_image(folder / "no/a.exr", image.view()), folder / "no/a.exr", "No such file");
    check_error(write_image(folder / "a.gif", image.view()), folder / "a.gif", ".exr, .hdr and .png");
    check_error(write_image(folder / "a", image.view()), folder / "a", ".exr, .hdr and .png");
    for (const char* name : {"full.exr", "full.hdr", "full.png"}) {
      std::filesystem::create_symlink("/dev/full", folder / name);
      check_error(write_image(folder / name, image.view()), folder / name, "No space left on device");
    }
    CHECK(folder.names().size() == 3);
  }

  TEST_CASE("image_writer: what is no picture is refused, what is too large is scaled down") {
    const ScratchFolder folder;
    check_error(read_image(folder / "gone.png"), folder / "gone.png", "no such file");
    check_error(read_image(folder.write("a.png", "text")), folder / "a.png", "cannot be read as an image");
    const Image image{64, 16, std::vector<float>(3 * 64 * 16, 0.25f)};
    REQUIRE(write_image(folder / "a.exr", image.view()));
    const auto small = read_image(folder / "a.exr", 10);
    REQUIRE(small);
    CHECK(small->width == 10);
    CHECK(small->height == 2);
    for (const float value : small->rgb) CHECK(value == 0.25f);
  }

  TEST_CASE("image_writer: textures pass through sixteen bits") {
    const ScratchFolder folder;
    const Image image{3, 1, {0.f, 1.f, 0.5f, 0.001f, 0.2f, 0.9f, 0.3f, 0.4f, 0.6f}};
    REQUIRE(write_texture(folder / "t.png", image.view()));
    const auto again = read_image(folder / "t.png");
    REQUIRE(again);
    for (std::size_t i = 0; i < 9; ++i) CHECK(again->rgb[i] == doctest::Approx(image.rgb[i]).epsilon(1e-3));
  }
}
