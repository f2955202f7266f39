#include "apps/cluster/memory_room.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;

namespace {

constexpr std::uint64_t gib = 1ull << 30;

/// A machine of 16 GiB, 10 of them free, as the kernel shows it.
struct Machine {
  test::ScratchFolder folder;
  Machine() { put("proc/meminfo", "MemTotal: 16777216 kB\nMemFree: 1 kB\nMemAvailable: 10485760 kB\n"); }
  void put(const std::string& path, const std::string& text) const {
    const std::filesystem::path whole = folder / path;
    std::filesystem::create_directories(whole.parent_path());
    std::ofstream(whole) << text;
  }
  apps::MemoryRoom room() const { return apps::memory_room(folder / ""); }
};

}  // namespace

TEST_SUITE("memory_room") {
  TEST_CASE("memory_room: without groups it is the machine's") {
    const Machine machine;
    CHECK(machine.room().total_bytes == 16 * gib);
    CHECK(machine.room().free_bytes == 10 * gib);
  }

  TEST_CASE("memory_room: the narrowest of all groups around the process counts, caches are free") {
    const Machine machine;
    machine.put("proc/self/cgroup", "0::/lab.slice/node.service\n");
    machine.put("sys/fs/cgroup/lab.slice/node.service/memory.max", "max\n");
    machine.put("sys/fs/cgroup/lab.slice/node.service/memory.current", "1073741824\n");
    CHECK(machine.room().total_bytes == 16 * gib);
    machine.put("sys/fs/cgroup/lab.slice/memory.max", "4294967296\n");
    machine.put("sys/fs/cgroup/lab.slice/memory.current", "3221225472\n");
    machine.put("sys/fs/cgroup/lab.slice/memory.stat", "anon 5\ninactive_file 2147483648\n");
    CHECK(machine.room().total_bytes == 4 * gib);
    CHECK(machine.room().free_bytes == 3 * gib);
  }

  TEST_CASE("memory_room: groups of version 1, and a path that a container does not show") {
    const Machine machine;
    machine.put("proc/self/cgroup", "5:cpu,cpuacct:/docker/abc\n4:memory:/docker/abc\n0::/\n");
    machine.put("sys/fs/cgroup/memory/memory.limit_in_bytes", "2147483648\n");
    machine.put("sys/fs/cgroup/memory/memory.usage_in_bytes", "1073741824\n");
    CHECK(machine.room().total_bytes == 2 * gib);
    CHECK(machine.room().free_bytes == 1 * gib);
  }

  TEST_CASE("memory_room: this machine has some") {
    CHECK(apps::memory_room().total_bytes > 0);
    CHECK(apps::memory_room().free_bytes <= apps::memory_room().total_bytes);
  }
}
