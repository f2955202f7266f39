/// Output files appear whole or not at all: bytes go to a temporary name in the same folder, which takes the final name
/// only after every byte has reached the disk.
///
/// A target that exists and is no regular file (a pipe, /dev/null) is written directly, since renaming would replace it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/expected.hpp"

namespace lichthof::io {

class AtomicFile {
 public:
  /// Opens the temporary file.
  /// @error io, naming the target: the folder is missing or not writable, the disk is full
  static Expected<AtomicFile> create(const std::string& path);

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  AtomicFile& operator=(AtomicFile&&) = delete;
  /// Removes the temporary file unless commit() succeeded.
  ~AtomicFile();

  /// Appends bytes. A failure is kept and reported by commit() too. @error io
  Status append(std::string_view bytes);

  /// Flushes to the disk, closes, and takes the final name. Nothing may be appended afterwards. @error io
  Status commit();

 private:
  AtomicFile(std::string path, std::string temporary, int fd);
  Error failure(const char* what, int code);
  Status drain(std::string_view bytes);

  std::string path_;       ///< as the user wrote it
  std::string target_;     ///< symbolic links followed
  std::string temporary_;  ///< empty: written directly
  std::string buffer_;
  int fd_ = -1;
  bool failed_ = false;
  Error error_;
};

/// A whole file in one call.
Status write_file(const std::string& path, std::string_view bytes);

/// Whether write_file would get as far as opening: asked before an hour of work, so that a mistyped folder is told at once.
Status writable(const std::string& path);

}  // namespace lichthof::io
