/// Names for bytes: what two machines hold alike has the same digest on both.
#pragma once

#include <string>
#include <string_view>

namespace lichthof::actors {

/// SHA-256, 64 hexadecimal digits in small letters.
std::string sha256_of(std::string_view bytes);

}  // namespace lichthof::actors
