#include "apps/cluster/memory_room.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>

namespace lichthof::apps {

namespace {

/// Files of a version of control groups.
struct GroupFiles {
  const char* mount;
  const char* limit;
  const char* usage;
  const char* cache;  ///< in memory.stat: pages that the kernel drops when memory is wanted
};
constexpr GroupFiles version2{"/sys/fs/cgroup", "/memory.max", "/memory.current", "inactive_file"};
constexpr GroupFiles version1{"/sys/fs/cgroup/memory", "/memory.limit_in_bytes", "/memory.usage_in_bytes",
                              "total_inactive_file"};

/// The number after a word; without a word the first one of the file. `max` is none.
std::optional<std::uint64_t> number_in(const std::string& path, const std::string& key = "") {
  std::ifstream file(path);
  std::uint64_t value = 0;
  if (key.empty()) return file >> value ? std::optional(value) : std::nullopt;
  for (std::string word; file >> word;)
    if (word == key && file >> value) return value;
  return std::nullopt;
}

void narrow(MemoryRoom& room, const std::string& folder, const GroupFiles& files) {
  const auto limit = number_in(folder + files.limit), used = number_in(folder + files.usage);
  if (!limit || !used || *limit >= room.total_bytes) return;
  room.total_bytes = *limit;
  const std::uint64_t cache = number_in(folder + "/memory.stat", files.cache).value_or(0);
  const std::uint64_t taken = *used - std::min(*used, cache);
  room.free_bytes = std::min(room.free_bytes, *limit - std::min(*limit, taken));
}

}  // namespace

MemoryRoom memory_room(const std::string& root) {
  MemoryRoom room;
  room.total_bytes = 1024 * number_in(root + "/proc/meminfo", "MemTotal:").value_or(0);
  room.free_bytes = 1024 * number_in(root + "/proc/meminfo", "MemAvailable:").value_or(0);
  // Lines are "number:controllers:path"; version 2 has the number 0 and no controllers.
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = ',' + line.substr(first + 1, second - first - 1) + ',';
    const bool is_memory = controllers.find(",memory,") != std::string::npos;
    if (!is_memory && controllers != ",,") continue;
    const GroupFiles& files = is_memory ? version1 : version2;
    // A limit holds for all groups below; inside a container only the last folders of the path may be there.
    for (std::string path = line.substr(second + 1); !path.empty() && path != "/"; path.resize(path.rfind('/')))
      narrow(room, root + files.mount + path, files);
    narrow(room, root + files.mount, files);
  }
  return room;
}

}  // namespace lichthof::apps
