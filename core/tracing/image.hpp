/// The film: columns of linear RGB, because a column is the atom of the second pass (§3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/check.hpp"
#include "core/base/types.hpp"

namespace lichthof {

/// width x height pixels of radiance, W/(m² sr); stored column by column, each from top to bottom.
class Image {
 public:
  Image() = default;
  Image(std::uint32_t width, std::uint32_t height)
      : width_(width), height_(height), pixels_(std::size_t{width} * height, Rgbf{0.f}) {}

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  Rgbf& at(std::uint32_t column, std::uint32_t row) { return pixels_[std::size_t{column} * height_ + row]; }
  const Rgbf& at(std::uint32_t column, std::uint32_t row) const { return pixels_[std::size_t{column} * height_ + row]; }
  std::span<const Rgbf> column(std::uint32_t index) const {
    return {pixels_.data() + std::size_t{index} * height_, height_};
  }
  /// Copies finished columns in. @pre pixels.size() is a multiple of the height and fits behind `first`
  void set_columns(std::uint32_t first, std::span<const Rgbf> pixels) {
    MUST(std::size_t{first} * height_ + pixels.size() <= pixels_.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels_[std::size_t{first} * height_ + i] = pixels[i];
  }
  bool operator==(const Image&) const = default;

 private:
  std::uint32_t width_ = 0, height_ = 0;
  std::vector<Rgbf> pixels_;
};

}  // namespace lichthof
