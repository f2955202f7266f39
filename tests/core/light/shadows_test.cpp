#include "core/light/shadows.hpp"

#include <doctest/doctest.h>

#include "core/light/receiver_tree.hpp"
#include "tests/support/hemicube_reference.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

const Vec3 origin{4, 2, 1};

/// Rooms with some small things in them, or crowded.
struct Furnished {
  Scene scene = *test::two_rooms();
  std::shared_ptr<const Mesh> mesh;
  std::vector<GroupId> groups;

  explicit Furnished(int things) {
    Random random(40 + static_cast<std::uint64_t>(things));
    for (int k = 0; k < things; ++k) {
      Surface surface;
      surface.corners = reference::random_polygon(
          random, {0.3 + 7.4 * random.unit(), 0.3 + 3.4 * random.unit(), 0.3 + 1.8 * random.unit()}, 0.2, 0.7);
      const Vec3 n = newell_vector(surface.corners);
      surface.area = 0.5 * glm::length(n), surface.normal = glm::normalize(n);
      surface.material = 0;
      scene.surfaces.push_back(surface);
    }
    mesh = test::mesh_with(scene, 0.5);
    for (std::uint32_t g = 0; g < mesh->groups.size(); ++g)
      if (mesh->group_is_lit[g]) groups.push_back({g});
  }
};

/// Whether a segment passes the edge of a surface so near that it may be taken either way: occluders are larger than their
/// surfaces by the offset, and single precision has half as much to add.
bool passes_an_edge(const Scene& scene, const Segments16& s, int lane, double offset) {
  const Vec3 from = Vec3{s.ox[lane], s.oy[lane], s.oz[lane]} + origin, way{s.dx[lane], s.dy[lane], s.dz[lane]};
  for (const Surface& surface : scene.surfaces)
    if (std::abs(reference::inside_by(from, from + way, surface.corners)) < 1.5 * offset) return true;
  return false;
}

}  // namespace

TEST_SUITE("shadows") {
  TEST_CASE("shadows: a packet loses the lanes that rays alone would take from it") {
    for (const int things : {0, 12, 400}) {
      const Furnished rooms(things);
      const ReceiverTree tree = receiver_tree(*rooms.mesh, rooms.groups, origin);
      const RayScene rays(rooms.scene, rooms.scene.surfaces, origin);
      const Occluders occluders(rooms.scene, rooms.scene.surfaces, origin, rays.offset());
      Random random(50);
      std::uint64_t lanes = 0, blocked = 0, saved = 0, asked = 0;
      for (int shot = 0; shot < 60; ++shot) {
        const Group& group =
            rooms.mesh->groups[rooms.groups[random.below(static_cast<std::uint32_t>(rooms.groups.size()))].value];
        const Plane& plane = rooms.mesh->planes[group.plane.value];
        std::vector<Vec3> corners;
        for (const Vec2& corner : rooms.mesh->polygon(group.polygon)) corners.push_back(plane.point(corner));
        const FlatShooter shooter = flat_shooter(corners, plane.normal, origin);
        const ShadowShooter caster(shooter, occluders, true);
        Aim16 aim;
        for (int i = 0; i < 32; ++i) {  // points spread between the centre and the corners
          const int k = i % 16 % shooter.count;
          const float t = static_cast<float>(i % 16) / 17.f;
          aim.x[i] = shooter.cx + t * (shooter.x[k] - shooter.cx),
          aim.y[i] = shooter.cy + t * (shooter.y[k] - shooter.cy);
          aim.z[i] = shooter.cz + t * (shooter.z[k] - shooter.cz);
        }
        Shadows shadows(caster, occluders, rays, true, nullptr);
        for (const std::uint32_t island : tree.islands) {
          const ReceiverNode& node = tree.nodes[island];
          shadows.enter_island({{node.lo[0], node.lo[1], node.lo[2]}, {node.hi[0], node.hi[1], node.hi[2]}});
          for (std::uint32_t i = node.first_item; i < node.first_item + node.item_count; ++i)
            for (std::uint32_t c = tree.items[i].first_cluster;
                 c < tree.items[i].first_cluster + tree.items[i].cluster_count; ++c) {
              const Cluster& cluster = tree.clusters[c];
              shadows.enter_cluster(
                  {{cluster.lo[0], cluster.lo[1], cluster.lo[2]}, {cluster.hi[0], cluster.hi[1], cluster.hi[2]}});
              shadows.enter_part(nullptr);
              Factors16 packet;
              clear_segments(packet.segments);
              const std::uint32_t seen =
                  kernels().factor16(cluster.points, cluster.lanes, shooter, aim, static_cast<int>(c % 16),
                                     static_cast<float>(rays.offset()), packet);
              if (seen == 0) continue;
              Segments16 alone = packet.segments;
              const std::uint32_t expected = rays.occluded16(alone, seen);
              shadows.cast(packet, seen);
              std::uint32_t found = 0;
              for (int lane = 0; lane < 16; ++lane) found |= (packet.segments.tfar[lane] < 0.f ? 1u : 0u) << lane;
              for (std::uint32_t left = (found & seen) ^ expected; left != 0; left &= left - 1)
                REQUIRE(passes_an_edge(rooms.scene, packet.segments, __builtin_ctz(left), rays.offset()));
              lanes += static_cast<std::uint64_t>(__builtin_popcount(seen));
              blocked += static_cast<std::uint64_t>(__builtin_popcount(expected));
            }
        }
        saved += shadows.rays_saved(), asked += shadows.rays();
      }
      CAPTURE(things);
      REQUIRE(lanes > 50000);
      CHECK(blocked > lanes / 20);
      CHECK(saved <= asked);
      CHECK(asked >= lanes);
      if (things < 100) CHECK(static_cast<double>(saved) > 0.9 * static_cast<double>(asked));
    }
  }

  TEST_CASE("shadows: a closed wall hides all that is behind it, and no more") {
    const std::shared_ptr<const Scene> scene = test::two_rooms(false);
    const RayScene rays(*scene, scene->surfaces, origin);
    const Occluders occluders(*scene, scene->surfaces, origin, rays.offset());
    const Polygon panel{{1, 1, 2}, {1, 2, 2}, {2, 2, 2}, {2, 1, 2}};
    const FlatShooter shooter = flat_shooter(panel, {0, 0, -1}, origin);
    const ShadowShooter caster(shooter, occluders, true);
    const auto box = [](const Vec3& lo, const Vec3& hi) {
      FlatBox flat;
      for (int axis = 0; axis < 3; ++axis)
        flat.lo[axis] = static_cast<float>(lo[axis] - origin[axis]),
        flat.hi[axis] = static_cast<float>(hi[axis] - origin[axis]);
      return flat;
    };
    Shadows shadows(caster, occluders, rays, true, nullptr);
    CHECK(!shadows.hide(box({5, 1, 0}, {7, 3, 1}), false));  // nothing is known yet
    CHECK(shadows.hide(box({5, 1, 0}, {7, 3, 1}), true));
    CHECK(shadows.hide(box({4.5, 0.5, 0.2}, {7, 3, 2}), false));
    CHECK(!shadows.hide(box({3, 1, 0}, {7, 3, 1}), true));  // reaches through the wall
    CHECK(!shadows.hide(box({3, 3, 0}, {3.9, 3.9, 0.5}), true));
  }
}
