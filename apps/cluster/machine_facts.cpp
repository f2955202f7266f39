#include "apps/cluster/machine_facts.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

#include "apps/cluster/memory_room.hpp"
#include "core/base/random.hpp"
#include "core/light/raycast.hpp"

namespace lichthof::apps {

namespace {

/// A line of /proc in bytes, 0 where there is none.
std::uint64_t kilobytes_at(const char* path, const std::string& key) {
  std::ifstream file(path);
  std::string word;
  std::uint64_t value = 0;
  while (file >> word)
    if (word == key && file >> value) return 1024 * value;
  return 0;
}

std::string folder(const char* variable, const char* in_home) {
  if (const char* given = std::getenv(variable); given && *given == '/') return std::string(given) + "/lichthof";
  const char* home = std::getenv("HOME");
  return std::string(home && *home ? home : "/tmp") + in_home + "/lichthof";
}

double cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void add_face(Scene& scene, const Vec3& corner, const Vec3& u, const Vec3& v) {
  Surface face;
  face.corners = {corner, corner + u, corner + u + v, corner + v};
  face.normal = glm::normalize(glm::cross(u, v));
  face.area = glm::length(glm::cross(u, v));
  scene.surfaces.push_back(face);
}

void add_body(Scene& scene, const Vec3& lo, const Vec3& size) {
  const Vec3 x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
  add_face(scene, lo, x, y), add_face(scene, lo + z, x, y);
  add_face(scene, lo, y, z), add_face(scene, lo + x, y, z);
  add_face(scene, lo, z, x), add_face(scene, lo + y, z, x);
}

}  // namespace

double measured_rays_per_s() {
  Random random(7);
  Scene scene;
  scene.materials.emplace_back();
  add_body(scene, Vec3{0.0}, {10, 8, 3});
  for (int k = 0; k < 150; ++k)
    add_body(scene, {0.5 + 8.5 * random.unit(), 0.5 + 6.5 * random.unit(), 1.5 * random.unit()},
             {0.1 + 0.5 * random.unit(), 0.1 + 0.5 * random.unit(), 0.1 + 0.7 * random.unit()});
  const RayScene rays(scene, scene.surfaces, Vec3{0.0});
  std::vector<Segments16> packets(256);
  const auto inside = [&] {
    return Vec3{9.8 * random.unit() + 0.1, 7.8 * random.unit() + 0.1, 2.8 * random.unit() + 0.1};
  };
  for (Segments16& packet : packets) {
    clear_segments(packet);
    const Vec3 target = inside(), middle = inside();
    for (int lane = 0; lane < 16; ++lane) {
      const Vec3 from = middle + 0.2 * Vec3{lane % 4, lane / 4, 0}, way = target - from;
      packet.ox[lane] = static_cast<float>(from.x), packet.oy[lane] = static_cast<float>(from.y);
      packet.oz[lane] = static_cast<float>(from.z), packet.dx[lane] = static_cast<float>(way.x);
      packet.dy[lane] = static_cast<float>(way.y), packet.dz[lane] = static_cast<float>(way.z);
    }
  }
  LaneMask16 all;
  std::fill_n(all.lane, 16, -1);
  double best = 0;
  for (int round = 0; round < 3; ++round) {
    const double start = cpu_s();
    double seconds = 0;
    std::uint64_t traced = 0;
    while ((seconds = cpu_s() - start) < 0.01)
      for (Segments16& packet : packets) {
        std::fill_n(packet.tfar, 16, 1.f);
        rays.occluded16(packet, all);
        traced += 16;
      }
    best = std::max(best, static_cast<double>(traced) / seconds);
  }
  return best;
}

std::uint64_t total_memory_bytes() { return memory_room().total_bytes; }
std::uint64_t free_memory_bytes() { return memory_room().free_bytes; }
std::uint64_t used_memory_bytes() { return kilobytes_at("/proc/self/status", "VmRSS:"); }

std::string machine_name() {
  std::array<char, 256> buffer{};
  std::string name = ::gethostname(buffer.data(), buffer.size() - 1) == 0 ? buffer.data() : "";
  name = name.substr(0, name.find('.'));
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
  if (name.empty() || name[0] == '-') name = "node";
  return name.substr(0, 64);
}

std::string cache_folder() { return folder("XDG_CACHE_HOME", "/.cache"); }
std::string state_folder() { return folder("XDG_STATE_HOME", "/.local/state"); }

}  // namespace lichthof::apps
