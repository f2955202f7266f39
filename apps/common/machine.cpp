#include "apps/common/machine.hpp"

#include <link.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <thread>

#include "core/light/kernels/kernels.hpp"
#include "io/atomic_file.hpp"

namespace lichthof::apps {

namespace {

namespace fs = std::filesystem;

constexpr double gigabyte = 1e9;
constexpr double little_memory = 1 * gigabyte, little_disk = 0.5 * gigabyte;
constexpr rlim_t few_files = 256, small_file = rlim_t{1} << 30;

std::string gigabytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f GB", bytes / gigabyte);
  return text;
}

/// The first line of a file; empty when there is none.
std::string first_line(const char* path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

Finding cpu() {
  Finding finding{"cpu", Health::good, std::string("vector code: ") + kernels().name, ""};
  if (std::string_view(available_kernels().back().name) == "x86-64-v2")
    finding.health = Health::poor,
    finding.mend = "this processor has no AVX2: everything works, at about half the speed";
  else if (std::string_view(kernels().name) != available_kernels().back().name)
    finding.health = Health::poor, finding.mend = "LICHTHOF_VECTOR asks for less than the processor can do; unset it";
  return finding;
}

/// Cores that the container's quota allows, or 0 for no quota. cgroup v2 writes "max 100000" or "150000 100000".
double quota_cores() {
  const std::string line = first_line("/sys/fs/cgroup/cpu.max");
  double quota = 0, period = 0;
  return std::sscanf(line.c_str(), "%lf %lf", &quota, &period) == 2 && period > 0 ? quota / period : 0;
}

Finding threads() {
  const unsigned usable = std::max(1u, std::thread::hardware_concurrency());
  Finding finding{"threads", Health::good, std::to_string(usable) + " usable", ""};
  cpu_set_t set;
  const long present = sysconf(_SC_NPROCESSORS_ONLN);
  if (sched_getaffinity(0, sizeof set, &set) == 0 && present > CPU_COUNT(&set))
    finding.detail += ", of " + std::to_string(present) + " present (this process is bound to some)";
  if (const double quota = quota_cores(); quota > 0 && quota + 0.5 < usable) {
    finding.health = Health::poor;
    finding.detail += ", but a quota of " + std::to_string(static_cast<int>(quota * 10) / 10.0).substr(0, 4) + " cores";
    finding.mend = "give --threads no more than the quota, or raise the container's quota";
  }
  return finding;
}

Finding memory() {
  double available = 0;
  std::ifstream file("/proc/meminfo");
  for (std::string line; std::getline(file, line);)
    if (double kibibytes = 0; std::sscanf(line.c_str(), "MemAvailable: %lf kB", &kibibytes) == 1)
      available = 1024 * kibibytes;
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    available = std::min(available, static_cast<double>(limit.rlim_cur));
  double most = 0;
  if (std::sscanf(first_line("/sys/fs/cgroup/memory.max").c_str(), "%lf", &most) == 1)
    available = std::min(available, most);
  Finding finding{"memory", Health::good, gigabytes(available) + " available", ""};
  if (available < little_memory)
    finding.health = Health::poor,
    finding.mend = "large scenes will not fit; close programs, or raise ulimit -v or the container's limit";
  return finding;
}

Finding limits() {
  rlimit files{}, size{};
  getrlimit(RLIMIT_NOFILE, &files);
  getrlimit(RLIMIT_FSIZE, &size);
  const auto shown = [](rlim_t value) {
    return value == RLIM_INFINITY ? std::string("unlimited") : std::to_string(value);
  };
  Finding finding{"limits", Health::good, "open files " + shown(files.rlim_cur) + ", file size " + shown(size.rlim_cur),
                  ""};
  if (files.rlim_cur < few_files)
    finding.health = Health::poor, finding.mend = "raise the number of open files: ulimit -n 1024";
  if (size.rlim_cur < small_file)
    finding.health = Health::poor, finding.mend = "solutions may not fit: ulimit -f unlimited";
  return finding;
}

Finding temporary_folder() {
  std::error_code problem;
  const fs::path folder = fs::temp_directory_path(problem);
  if (problem)
    return {"temporary folder", Health::broken, "there is none: " + problem.message(),
            "point TMPDIR to a folder that can be written"};
  const fs::path file = folder / ("lichthof-doctor-" + std::to_string(::getpid()));
  const Status written = io::write_file(file.string(), "lichthof");
  fs::remove(file, problem);
  if (!written)
    return {"temporary folder", Health::broken, written.error().text(),
            "point TMPDIR to a folder that can be written, or make room in it"};
  const fs::space_info space = fs::space(folder, problem);
  const double free_bytes = problem ? 0 : static_cast<double>(space.available);
  Finding finding{"temporary folder", Health::good,
                  folder.string() + " can be written, " + gigabytes(free_bytes) + " free", ""};
  if (free_bytes < little_disk)
    finding.health = Health::poor, finding.mend = "make room in it, or point TMPDIR elsewhere";
  return finding;
}

/// Real names of the shared libraries this process has loaded: their endings are their versions.
std::vector<std::string> loaded_libraries() {
  std::vector<std::string> names;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* data) {
        std::error_code problem;
        const fs::path real = fs::canonical(info->dlpi_name, problem);
        if (!problem) static_cast<std::vector<std::string>*>(data)->push_back(real.filename().string());
        return 0;
      },
      &names);
  return names;
}

Finding libraries() {
  Finding finding{"libraries", Health::good, std::string("built with ") + LICHTHOF_BUILT_WITH + "; loaded", ""};
  for (const std::string& name : loaded_libraries())
    for (const char* ours : {"libembree3.so", "libcaf_core.so", "libOpenImageIO.so", "libtbb.so", "libzstd.so"})
      if (name.starts_with(ours)) finding.detail += " " + name;
  return finding;
}

}  // namespace

std::vector<Finding> machine_findings() {
  return {cpu(), threads(), memory(), limits(), temporary_folder(), libraries()};
}

}  // namespace lichthof::apps
