#include <cstdlib>
#include <string_view>

#include "core/base/check.hpp"
#include "core/light/kernels/kernels.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof {

#define LICHTHOF_DECLARE(width)                                                                          \
  namespace width {                                                                                      \
  std::uint32_t factor16(const Receivers16&, std::uint32_t, const FlatShooter&, const Aim16&, int,       \
                         float, Factors16&);                                                             \
  float accumulate16(Factors16&, const float*, const float (&)[3], Sums16&);                             \
  bool block16(const FlatOccluder&, Segments16&, LaneMask16&);                                           \
  bool hidden8(const float (&)[3][8], const FlatPolygon&, const FlatOccluder&, float);                   \
  std::size_t in_shaft(const Shaft&, const Occluders16*, const ShooterSides*, const Candidates*,         \
                       std::size_t, Candidates*);                                                        \
  }
LICHTHOF_DECLARE(width_v2)
LICHTHOF_DECLARE(width_avx2)
LICHTHOF_DECLARE(width_avx512)
#undef LICHTHOF_DECLARE

std::span<const Kernels> available_kernels() {
#define LICHTHOF_KERNELS(name, width) \
  {name, width::factor16, width::accumulate16, width::block16, width::hidden8, width::in_shaft}
  static const std::array<Kernels, 3> all{{LICHTHOF_KERNELS("x86-64-v2", width_v2), LICHTHOF_KERNELS("avx2", width_avx2),
                                           LICHTHOF_KERNELS("avx512", width_avx512)}};
#undef LICHTHOF_KERNELS
  static const std::size_t count = [] {
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2")) return std::size_t{1};
    const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
    return std::size_t{wide ? 3u : 2u};
  }();
  return {all.data(), count};
}

const Kernels& kernels() {
  static const Kernels chosen = [] {
    const std::span<const Kernels> available = available_kernels();
    if (const char* wish = std::getenv("LICHTHOF_VECTOR"))
      for (const Kernels& k : available)
        if (std::string_view(wish) == k.name) return k;
    return available.back();
  }();
  return chosen;
}

FlatPolygon flat_polygon(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin) {
  MUST(corners.size() >= 3 && corners.size() <= FlatPolygon::max_corners);
  FlatPolygon flat;
  flat.count = static_cast<int>(corners.size());
  for (int k = 0; k < flat.count; ++k) {
    const Vec3 local = corners[static_cast<std::size_t>(k)] - origin;
    flat.x[k] = static_cast<float>(local.x);
    flat.y[k] = static_cast<float>(local.y);
    flat.z[k] = static_cast<float>(local.z);
  }
  flat.nx = static_cast<float>(normal.x), flat.ny = static_cast<float>(normal.y), flat.nz = static_cast<float>(normal.z);
  const Vec3 centre = centroid(corners) - origin;
  flat.cx = static_cast<float>(centre.x), flat.cy = static_cast<float>(centre.y), flat.cz = static_cast<float>(centre.z);
  return flat;
}

FlatShooter flat_shooter(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin) {
  FlatShooter flat;
  static_cast<FlatPolygon&>(flat) = flat_polygon(corners, normal, origin);
  const auto edge = [&](std::size_t k) { return corners[k + 1 == corners.size() ? 0 : k + 1] - corners[k]; };
  std::size_t longest = 0;  // gives the axis u with the least rounding
  for (std::size_t k = 1; k < corners.size(); ++k)
    if (glm::length(edge(k)) > glm::length(edge(longest))) longest = k;
  const Vec3 along = edge(longest) - glm::dot(edge(longest), normal) * normal;
  const Vec3 u = glm::normalize(along), v = glm::cross(normal, u), centre = centroid(corners);
  flat.ux = static_cast<float>(u.x), flat.uy = static_cast<float>(u.y), flat.uz = static_cast<float>(u.z);
  flat.vx = static_cast<float>(v.x), flat.vy = static_cast<float>(v.y), flat.vz = static_cast<float>(v.z);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 from = corners[k] - centre;
    flat.u[k] = static_cast<float>(glm::dot(from, u)), flat.v[k] = static_cast<float>(glm::dot(from, v));
    flat.eu[k] = static_cast<float>(glm::dot(edge(k), u)), flat.ev[k] = static_cast<float>(glm::dot(edge(k), v));
  }
  return flat;
}

FlatOccluder flat_occluder(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin, double margin,
                           std::vector<OccluderEdge>& edges) {
  const glm::vec3 flat_normal{normal};
  const Vec3 n{flat_normal};
  const auto corner = [&](std::size_t k) { return Vec3{glm::vec3{corners[k % corners.size()] - origin}}; };
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 a = corner(k), m = glm::cross(n, corner(k + 1) - a);
    const glm::vec3 at{a}, inwards{m};
    edges.push_back({at.x, at.y, at.z, inwards.x, inwards.y, inwards.z,
                     static_cast<float>(glm::dot(m, a) - margin * glm::length(m))});
  }
  return {{}, flat_normal.x, flat_normal.y, flat_normal.z, static_cast<float>(glm::dot(n, corner(0)))};
}

}  // namespace lichthof
