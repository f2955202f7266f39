#include "io/image_writer.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/image_codec.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr double key = 0.18;
constexpr std::uint64_t most_pixels = 1u << 28;

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

std::vector<std::uint8_t> tone_mapped(const ImageView& image, const ToneMapping& tone) {
  const double factor = exposure_factor(image, tone);
  const std::size_t count = std::size_t{3} * image.width * image.height;
  std::vector<std::uint8_t> bytes(count);
  for (std::size_t i = 0; i < count; ++i)
    bytes[i] = static_cast<std::uint8_t>(std::lround(255.0 * srgb_encoded(filmic(factor * image.rgb[i]))));
  return bytes;
}

Status write_encoded(const std::string& path, const std::string& ending, const PixelView& pixels) {
  const Expected<const ImageCodec*> codec = image_codec();
  if (!codec) return codec.error();
  const auto bytes = (*codec)->encode(ending, pixels);
  if (!bytes) return Error{bytes.error().code, path, bytes.error().message};
  return write_file(path, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

/// Mean of the pixels that fall together; every output pixel covers a whole number of them or one more.
Image scaled_down(const Image& image, std::uint32_t longest_side) {
  const std::uint32_t longest = std::max(image.width, image.height);
  const auto scaled = [&](std::uint32_t side) {
    return std::max(1u, static_cast<std::uint32_t>(std::uint64_t{side} * longest_side / longest));
  };
  Image small{scaled(image.width), scaled(image.height), {}};
  small.rgb.resize(std::size_t{3} * small.width * small.height);
  for (std::uint64_t y = 0; y < small.height; ++y) {
    const std::uint64_t y0 = y * image.height / small.height,
                        y1 = std::max(y0 + 1, (y + 1) * image.height / small.height);
    for (std::uint64_t x = 0; x < small.width; ++x) {
      const std::uint64_t x0 = x * image.width / small.width,
                          x1 = std::max(x0 + 1, (x + 1) * image.width / small.width);
      double sum[3] = {};
      for (std::uint64_t v = y0; v < y1; ++v)
        for (std::uint64_t u = x0; u < x1; ++u)
          for (int c = 0; c < 3; ++c) sum[c] += image.rgb[3 * (v * image.width + u) + static_cast<std::size_t>(c)];
      for (int c = 0; c < 3; ++c)
        small.rgb[3 * (y * small.width + x) + static_cast<std::size_t>(c)] =
            static_cast<float>(sum[c] / static_cast<double>((x1 - x0) * (y1 - y0)));
    }
  }
  return small;
}

/// Grey, grey with alpha, RGB, RGBA or more channels to linear RGB.
Image linear_rgb(const StoredImage& stored) {
  Image image{stored.width, stored.height, {}};
  const std::size_t channels = stored.channels, count = std::size_t{image.width} * image.height;
  image.rgb.resize(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = stored.values[i * channels + (channels >= 3 ? c : 0)];
      image.rgb[3 * i + c] = stored.srgb ? static_cast<float>(srgb_decoded(value)) : value;
    }
  }
  return image;
}

}  // namespace

double exposure_factor(const ImageView& image, const ToneMapping& tone) {
  if (tone.exposure_ev) return std::exp2(*tone.exposure_ev);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < std::size_t{image.width} * image.height; ++i) {
    const float* p = image.rgb + 3 * i;
    const double y = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    if (!(y > 0) || !std::isfinite(y)) continue;
    sum += std::log(y);
    ++count;
  }
  return count == 0 ? 1.0 : key / std::exp(sum / static_cast<double>(count));
}

double filmic(double x) {
  if (!(x > 0)) return 0;
  if (x > 1e6) return 1;
  return std::min(1.0, x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14));
}

double srgb_encoded(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double srgb_decoded(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

Status write_image(const std::string& path, const ImageView& image, const ToneMapping& tone) {
  MUST(image.width > 0 && image.height > 0 && image.rgb != nullptr);
  const std::string ending = ending_of(path);
  if (ending != ".exr" && ending != ".hdr" && ending != ".png")
    return bad_input(path, "unknown kind of picture; .exr, .hdr and .png can be written");
  if (ending != ".png") return write_encoded(path, ending, {image.width, image.height, PixelType::float32, image.rgb});
  const std::vector<std::uint8_t> bytes = tone_mapped(image, tone);
  return write_encoded(path, ending, {image.width, image.height, PixelType::uint8, bytes.data()});
}

Status write_texture(const std::string& path, const ImageView& image) {
  std::vector<std::uint16_t> values(std::size_t{3} * image.width * image.height);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::uint16_t>(std::lround(65535.0 * srgb_encoded(std::clamp(image.rgb[i], 0.f, 1.f))));
  return write_encoded(path, ".png", {image.width, image.height, PixelType::uint16, values.data()});
}

Expected<Image> read_image(const std::string& path, std::uint32_t longest_side) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(path, problem)) return bad_input(path, "cannot be opened: no such file");
  const Expected<const ImageCodec*> codec = image_codec();
  if (!codec) return codec.error();
  const Expected<StoredImage> stored = (*codec)->decode(path, 3 * most_pixels);
  if (!stored) return stored.error();
  Image image = linear_rgb(*stored);
  if (longest_side > 0 && std::max(image.width, image.height) > longest_side) return scaled_down(image, longest_side);
  return image;
}

}  // namespace lichthof::io
