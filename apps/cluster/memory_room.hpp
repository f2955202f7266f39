/// Memory that this process may use: the machine's, or what its control groups leave it.
#pragma once

#include <cstdint>
#include <string>

namespace lichthof::apps {

struct MemoryRoom {
  std::uint64_t total_bytes = 0;
  std::uint64_t free_bytes = 0;  ///< what may still be taken without anything being written to disk
};
/// The narrowest of the machine and all groups the process is in (cgroups of version 2, and `memory` of version 1).
/// @param root  folder that holds proc/ and sys/, for tests
MemoryRoom memory_room(const std::string& root = "");

}  // namespace lichthof::apps
