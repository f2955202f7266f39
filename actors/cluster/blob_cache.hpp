/// Pieces of data that the lead hands out and nodes keep, each under the SHA-256 of its bytes: a solution travels to a node once.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::actors {

/// Makes room in a folder: what was used longest ago goes first, but neither the file `keep` nor what is still being written.
void trim_folder(const std::string& folder, std::uint64_t most_bytes, const std::string& keep);

class BlobCache {
 public:
  /// @param folder      made where it is missing, for its owner alone
  /// @param most_bytes  what was used longest ago goes first
  BlobCache(std::string folder, std::uint64_t most_bytes) : folder_(std::move(folder)), most_bytes_(most_bytes) {}
  /// @error io
  Status open();

  /// Path of a blob that is here whole.
  std::optional<std::string> find(const std::string& hash) const;
  /// Takes a file over by renaming it. @returns its hash @error io
  Expected<std::string> adopt(const std::string& path);
  /// A stretch of a blob that is here. @param total  its size @error bad_input: it is not here
  Expected<std::vector<std::uint8_t>> part(const std::string& hash, std::uint64_t offset, std::size_t most,
                                           std::uint64_t& total) const;
  /// Appends to a blob under way. @returns whether it is whole and its hash right
  /// @error io; bad_input: a gap, or the bytes have another hash (what had arrived is thrown away)
  Expected<bool> append(const std::string& hash, std::uint64_t offset, std::uint64_t total,
                        std::span<const std::uint8_t> bytes);
  void remove(const std::string& hash) const;
  /// Makes room. @param keep  not this one
  void trim(const std::string& keep) const;
  std::string path(const std::string& hash) const { return folder_ + "/" + hash + ".lht"; }

 private:
  std::string folder_;
  std::uint64_t most_bytes_;
};

}  // namespace lichthof::actors
