/// The door to OpenImageIO, which is loaded when the first picture is read or written and not before: it brings some 250
/// libraries with it, and loading them costs a run that touches no picture more than lighting a small room does.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::io {

enum class PixelType { uint8, uint16, float32 };

/// Pixels to encode: three values each, row by row from the top. Integers are sRGB, floats linear.
struct PixelView {
  std::uint32_t width = 0, height = 0;
  PixelType type = PixelType::float32;
  const void* data = nullptr;
};

/// What a file holds, as stored: alpha is not multiplied in, sRGB not decoded.
struct StoredImage {
  std::uint32_t width = 0, height = 0, channels = 0;
  bool srgb = false;  ///< the values are sRGB encoded
  std::vector<float> values;
};

/// Encodes and decodes pictures. Stateless, may be used by several threads.
class ImageCodec {
 public:
  virtual ~ImageCodec() = default;

  /// The bytes of a file in the format that `ending` (".png") names. @error failed: no writer; io: cannot be encoded
  virtual Expected<std::vector<unsigned char>> encode(const std::string& ending, const PixelView& pixels) const = 0;

  /// @error bad_input: not an image, without pixels, or with more than `most_values`
  virtual Expected<StoredImage> decode(const std::string& path, std::uint64_t most_values) const = 0;
};

/// Loads the codec at the first call, from beside the program or from ../lib/lichthof. Costs .15 s then.
/// @error failed: the module or OpenImageIO itself can't be loaded
Expected<const ImageCodec*> image_codec();

/// What the module gives to image_codec(), by this name.
extern "C" const ImageCodec* lichthof_image_codec();

}  // namespace lichthof::io
