/// Names for bytes: what two machines hold alike has the same digest on both.
#pragma once

#include <string>
#include <string_view>

#include "core/base/expected.hpp"

namespace lichthof::actors {

/// SHA-256, 64 hexadecimal digits in small letters.
std::string sha256_of(std::string_view bytes);
/// Of a file's bytes, which need not fit into memory. @error io
Expected<std::string> sha256_of_file(const std::string& path);
/// Whether a text looks like one.
bool is_sha256(std::string_view text);

}  // namespace lichthof::actors
