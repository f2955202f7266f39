// The module lichthof_images.so: all that is linked with OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>

#include "io/image_codec.hpp"

namespace lichthof::io {

namespace {

/// Messages of the library may have several lines; ours have one.
std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.empty() ? "unknown error" : text;
}

OIIO::TypeDesc type_of(PixelType type) {
  switch (type) {
    case PixelType::uint8:
      return OIIO::TypeDesc::UINT8;
    case PixelType::uint16:
      return OIIO::TypeDesc::UINT16;
    case PixelType::float32:
      break;
  }
  return OIIO::TypeDesc::FLOAT;
}

bool is_srgb(const OIIO::ImageSpec& spec) {
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  if (space == "Linear" || space == "linear" || space == "scene_linear") return false;
  return spec.format.basetype == OIIO::TypeDesc::UINT8 || spec.format.basetype == OIIO::TypeDesc::UINT16;
}

class OpenImageCodec final : public ImageCodec {
 public:
  /// The file's bytes, made in memory: OpenImageIO's writers do not all notice a full disk, our own writing does.
  Expected<std::vector<unsigned char>> encode(const std::string& ending, const PixelView& pixels) const override {
    const std::string name = "picture" + ending;
    auto output = OIIO::ImageOutput::create(name);
    if (!output) return Error{ErrorCode::failed, "", "no writer for " + ending + ": " + one_line(OIIO::geterror())};
    const OIIO::TypeDesc type = type_of(pixels.type);
    OIIO::ImageSpec spec(static_cast<int>(pixels.width), static_cast<int>(pixels.height), 3, type);
    spec.attribute("oiio:ColorSpace", pixels.type == PixelType::float32 ? "Linear" : "sRGB");
    if (ending == ".exr") spec.attribute("compression", "zip");

    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    if (!output->set_ioproxy(&memory))
      return Error{ErrorCode::failed, "", "the writer for " + ending + " can't write to memory"};
    const bool good = output->open(name, spec) && output->write_image(type, pixels.data);
    const std::string problem = good ? "" : one_line(output->geterror());
    if (!output->close() || !good) return Error{ErrorCode::io, "", "cannot be encoded: " + problem};
    return bytes;
  }

  Expected<StoredImage> decode(const std::string& path, std::uint64_t most_values) const override {
    const auto bad = [&](const std::string& message) { return Error{ErrorCode::bad_input, path, message}; };
    // Colours as stored: alpha must not darken them.
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::open(path, &config);
    if (!input) return bad("cannot be read as an image: " + one_line(OIIO::geterror()));
    const OIIO::ImageSpec spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1) return bad("has no pixels to show");
    StoredImage image{static_cast<std::uint32_t>(spec.width),
                      static_cast<std::uint32_t>(spec.height),
                      static_cast<std::uint32_t>(spec.nchannels),
                      is_srgb(spec),
                      {}};
    if (std::uint64_t{image.width} * image.height * std::max(image.channels, 3u) > most_values)
      return bad("has too many pixels: " + std::to_string(image.width) + " x " + std::to_string(image.height));
    image.values.resize(std::size_t{image.width} * image.height * image.channels);
    if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.values.data()))
      return bad("cannot be read as an image: " + one_line(input->geterror()));
    input->close();
    return image;
  }
};

}  // namespace

extern "C" __attribute__((visibility("default"))) const ImageCodec* lichthof_image_codec() {
  static const OpenImageCodec codec;
  return &codec;
}

}  // namespace lichthof::io
