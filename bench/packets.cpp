#include "bench/packets.hpp"

#include "core/base/random.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t packets_per_group = 32;

std::vector<GroupId> lit_groups(const Mesh& mesh) {
  std::vector<GroupId> groups;
  for (std::uint32_t g = 0; g < mesh.groups.size(); ++g)
    if (mesh.group_is_lit[g]) groups.push_back(GroupId{g});
  return groups;
}

/// Uniform on a convex polygon.
Vec2 random_point(std::span<const Vec2> corners, Random& random) {
  double wanted = random.unit() * signed_area(corners);
  std::size_t k = 2;
  for (; k + 1 < corners.size(); ++k) {
    const Vec2 fan[3] = {corners[0], corners[k - 1], corners[k]};
    const double part = signed_area(fan);
    if (wanted < part) break;
    wanted -= part;
  }
  double a = random.unit(), b = random.unit();
  if (a + b > 1) a = 1 - a, b = 1 - b;
  return corners[0] + a * (corners[k - 1] - corners[0]) + b * (corners[k] - corners[0]);
}

/// @returns false unless all 16 receivers stand before the group and have it above their horizon where the rays end
bool fill(Segments16& packet, const Cluster& cluster, const Mesh& mesh, const Group& group, const PacketScene& scene,
          Random& random) {
  const Plane& plane = mesh.planes[group.plane.value];
  const double offset = scene.rays.offset();
  const Receivers16& r = cluster.points;
  for (int lane = 0; lane < 16; ++lane) {
    const Vec3 point{r.x[lane], r.y[lane], r.z[lane]}, normal{r.nx[lane], r.ny[lane], r.nz[lane]};
    const Vec3 aim = plane.point(random_point(mesh.polygon(group.polygon), random)) - scene.origin;
    if (glm::dot(point - aim, plane.normal) <= offset || glm::dot(aim - point, normal) <= offset) return false;
    const Vec3 from = point + offset * normal, way = aim + offset * plane.normal - from;
    packet.ox[lane] = static_cast<float>(from.x), packet.dx[lane] = static_cast<float>(way.x);
    packet.oy[lane] = static_cast<float>(from.y), packet.dy[lane] = static_cast<float>(way.y);
    packet.oz[lane] = static_cast<float>(from.z), packet.dz[lane] = static_cast<float>(way.z);
  }
  return true;
}

}  // namespace

PacketScene::PacketScene(const BenchCase& scene)
    : origin(bounds(*scene.scene()).centre()), rays(*scene.scene(), scene.scene()->surfaces, origin, Glass::clear),
      tree(receiver_tree(*scene.mesh(), lit_groups(*scene.mesh()), origin)) {}

std::vector<Segments16> packets_of(const BenchCase& scene, const PacketScene& packets, std::size_t count,
                                   std::uint64_t seed) {
  const Mesh& mesh = *scene.mesh();
  const auto clusters = static_cast<std::uint32_t>(packets.tree.clusters.size());
  Random random(seed);
  std::vector<Segments16> filled;
  Segments16 packet;
  clear_segments(packet);
  for (std::size_t tries = 0; filled.size() < count && tries < 4 * count; ++tries) {
    const GroupPlace& place = packets.tree.groups[random.below(static_cast<std::uint32_t>(packets.tree.groups.size()))];
    const Group& group = mesh.groups[place.mesh_group];
    const std::uint32_t first = random.below(clusters);
    std::size_t made = 0;
    for (std::uint32_t k = 0; k < clusters && made < packets_per_group && filled.size() < count; ++k) {
      const Cluster& cluster = packets.tree.clusters[(first + k) % clusters];
      if (cluster.lanes != 0xffff || !fill(packet, cluster, mesh, group, packets, random)) continue;
      filled.push_back(packet);
      ++made;
    }
  }
  return filled;
}

}  // namespace lichthof::bench
