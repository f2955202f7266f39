/// Finished columns of a picture on the controller's disk, so that one that is interrupted goes on from them. Columns are added to
/// the end of one file as they come; a record that was torn off at the end is noticed and dropped.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/types.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof::actors {

class KeptColumns {
 public:
  /// Reads what the file holds; one of another key, or of none, begins empty.
  /// @param key  what the columns are of: light, picture, version of the program
  /// @error io
  static Expected<KeptColumns> open(const std::string& path, const std::string& key, std::uint32_t columns,
                                    std::uint32_t height);

  bool has(std::uint32_t column) const { return is_kept_[column] != 0; }
  /// What was there when it was opened, each column as a job of its own; told once.
  std::vector<ColumnResult> take() { return std::move(found_); }
  /// @pre not kept yet, `height` pixels. @error io
  Status add(std::uint32_t column, std::span<const Rgbf> pixels, std::uint64_t rays);

 private:
  KeptColumns(std::string path, std::uint32_t columns, std::uint32_t height)
      : path_(std::move(path)), height_(height), is_kept_(columns, 0) {}
  std::size_t read(std::span<const std::uint8_t> bytes);

  std::string path_;
  std::uint32_t height_;
  std::vector<std::uint8_t> is_kept_;
  std::vector<ColumnResult> found_;
};

}  // namespace lichthof::actors
