/// Pictures in files: `.exr` and `.hdr` keep linear radiance, `.png` is tone mapped for a screen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::io {

/// Linear sRGB, three floats a pixel, row by row from the top; the memory is the caller's.
struct ImageView {
  std::uint32_t width = 0, height = 0;
  const float* rgb = nullptr;
};

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;
  ImageView view() const { return {width, height, rgb.data()}; }
};

/// How radiance becomes a grey between 0 and 1:  display = sRGB(filmic(factor · radiance)).
///
///     factor = 2^exposure_ev, or key 0.18 / log-average luminance where none is given  [Reinhard02, eq. 1, 2]
///     filmic(x) = x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), clamped                [Narkowicz15]
struct ToneMapping {
  std::optional<double> exposure_ev;
};

/// The factor a picture is multiplied by. Pixels that are black, or not finite, have no say in the average; a picture of
/// nothing else gets 1.
double exposure_factor(const ImageView& image, const ToneMapping& tone);

/// One channel after `factor` was applied, in [0, 1], linear: what a screen should emit. NaN becomes 0.
double filmic(double value);

/// Linear to sRGB and back, for values in [0, 1]. @source IEC 61966-2-1
double srgb_encoded(double linear);
double srgb_decoded(double encoded);

/// Writes the picture; the ending of the name chooses the format. `tone` only matters to `.png`.
/// @pre   width, height ≥ 1
/// @error bad_input: another ending; io: not writable, disk full; nothing half-written stays behind
Status write_image(const std::string& path, const ImageView& image, const ToneMapping& tone = {});

/// Writes values in [0, 1] as 16 bit sRGB `.png` without any tone mapping: for textures. @error io
Status write_texture(const std::string& path, const ImageView& image);

/// Reads any format OpenImageIO knows as linear RGB: sRGB is decoded where the file says so or has 8 or 16 bit integers,
/// grey becomes RGB, alpha is ignored.
/// @param longest_side  larger images are scaled down to it; 0: as they are
/// @error bad_input: unreadable, or more than 2^28 pixels
Expected<Image> read_image(const std::string& path, std::uint32_t longest_side = 0);

}  // namespace lichthof::io
