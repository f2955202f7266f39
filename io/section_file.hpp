/// A container of named, compressed, checksummed sections: what a solution file is made of.
///
///     magic 8 · version u32 · sections u32 · file bytes u64 · checksum of all before and of the table u64
///     table: per section name 8 · offset u64 · stored bytes u64 · raw bytes u64 · checksum of the stored bytes u64
///     sections: zstd frames with their own content checksum
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::io {

/// What tells one kind of file from another, in bytes and in messages.
struct SectionFormat {
  std::string_view magic;  ///< 8 bytes
  std::uint32_t version = 1;
  std::string_view kind;  ///< "solution file", for messages
};

using Sections = std::vector<std::pair<std::string, std::string>>;  ///< name (at most 8 bytes), raw bytes

/// @error io; nothing half-written stays behind
Status write_sections(const std::string& path, const SectionFormat& format, const Sections& sections);

class SectionFile {
 public:
  /// Reads the file and checks header, table and checksums; decompresses nothing yet.
  /// @error bad_input, one line: not such a file, another version, truncated, damaged
  static Expected<SectionFile> open(const std::string& path, const SectionFormat& format);

  /// The raw bytes of a section.
  /// @param most_bytes  a section that claims to be larger is refused before memory is taken
  /// @error bad_input: no such section, too large, damaged
  Expected<std::string> section(std::string_view name, std::uint64_t most_bytes) const;

 private:
  struct Entry {
    std::string name;
    std::uint64_t offset = 0, stored = 0, raw = 0, check = 0;
  };
  std::string path_, bytes_;
  std::string kind_;
  std::vector<Entry> table_;
};

}  // namespace lichthof::io
