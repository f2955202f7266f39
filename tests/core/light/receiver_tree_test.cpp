#include "core/light/receiver_tree.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

struct TreeOfRooms {
  std::shared_ptr<const Scene> scene = test::two_rooms();
  Mesh mesh;
  std::vector<GroupId> groups;
  ReceiverTree tree;
  Vec3 origin{4, 2, 1};

  explicit TreeOfRooms(double patch_size, double element_size = 0) {
    MeshOptions options;
    options.patch_size = patch_size;
    options.element_size = element_size;
    mesh = mesh_of(*scene, options, {});
    for (std::uint32_t g = 0; g < mesh.groups.size(); ++g)
      if (g % 5) groups.push_back({g});  // a cell holds only some
    tree = receiver_tree(mesh, groups, origin);
  }
};

}  // namespace

TEST_SUITE("receiver_tree") {
  TEST_CASE("receiver_tree: every element of the groups has one lane, and no other") {
    for (const auto& [patch_size, element_size] :
         {std::pair{2.0, 0.5}, {0.5, 0.125}, {0.2, 0.05}, {0.2, 0.1}, {0.2, 0.2}}) {
      const TreeOfRooms rooms(patch_size, element_size);
      std::vector<int> wanted(rooms.mesh.elements.size(), 0), lanes(rooms.mesh.elements.size(), 0);
      for (const GroupId id : rooms.groups) {
        const Group& group = rooms.mesh.groups[id.value];
        for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
          for (std::uint32_t e = 0; e < rooms.mesh.patches[p].element_count; ++e)
            ++wanted[rooms.mesh.patches[p].first_element + e];
      }
      for (const Cluster& cluster : rooms.tree.clusters)
        for (int lane = 0; lane < 16; ++lane) {
          if (!(cluster.lanes >> lane & 1)) {
            CHECK(cluster.area[lane] == 0);
            continue;
          }
          const std::uint32_t e = cluster.element[lane];
          ++lanes[e];
          const PatchPlace& place = rooms.tree.patches[cluster.first_patch + cluster.patch[lane]];
          const Patch& patch = rooms.mesh.patches[place.mesh_patch];
          REQUIRE(e == patch.first_element + (static_cast<std::uint32_t>(lane) - place.first_lane));
          const Plane& plane = rooms.mesh.planes[patch.plane.value];
          const Vec3 point = plane.point(rooms.mesh.elements[e].centre) - rooms.origin;
          const Receivers16& r = cluster.points;
          REQUIRE(glm::length(Vec3{r.x[lane], r.y[lane], r.z[lane]} - point) < 1e-5);
          REQUIRE(glm::length(Vec3{r.nx[lane], r.ny[lane], r.nz[lane]} - plane.normal) < 1e-6);
          REQUIRE(cluster.area[lane] == rooms.mesh.elements[e].area);
          for (int axis = 0; axis < 3; ++axis)
            REQUIRE((cluster.lo[axis] <= point[axis] + 1e-5 && cluster.hi[axis] >= point[axis] - 1e-5));
          if (cluster.single_patch) REQUIRE(cluster.patch[lane] == cluster.patch[0]);
        }
      CHECK(lanes == wanted);
    }
  }

  TEST_CASE("receiver_tree: neighbouring patches of few elements fill clusters together") {
    for (const double element_size : {0.1, 0.2}) {
      const TreeOfRooms rooms(0.2, element_size);
      std::size_t receivers = 0;
      for (const Cluster& cluster : rooms.tree.clusters)
        receivers += static_cast<std::size_t>(__builtin_popcount(cluster.lanes));
      CAPTURE(element_size);
      CHECK(static_cast<double>(receivers) > 10.0 * static_cast<double>(rooms.tree.clusters.size()));
    }
  }

  TEST_CASE("receiver_tree: islands hold every item once, items hold every group once") {
    const TreeOfRooms rooms(0.2);
    const ReceiverTree& tree = rooms.tree;
    CHECK(tree.islands.size() > 3);
    std::vector<int> items(tree.items.size(), 0), clusters(tree.clusters.size(), 0), groups(tree.groups.size(), 0);
    for (const std::uint32_t island : tree.islands) {
      const ReceiverNode& root = tree.nodes[island];
      for (std::uint32_t i = root.first_item; i < root.first_item + root.item_count; ++i) ++items[i];
    }
    for (const ReceiverItem& item : tree.items) {
      for (std::uint32_t c = 0; c < item.cluster_count; ++c) ++clusters[item.first_cluster + c];
      for (std::uint32_t g = 0; g < item.group_count; ++g) {
        ++groups[item.first_group + g];
        const GroupPlace& group = tree.groups[item.first_group + g];
        for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
          REQUIRE(tree.patches[p].first_cluster >= item.first_cluster);
          REQUIRE(tree.patches[p].first_cluster < item.first_cluster + item.cluster_count);
        }
      }
    }
    for (const auto* counts : {&items, &clusters, &groups})
      CHECK(std::all_of(counts->begin(), counts->end(), [](int n) { return n == 1; }));
    std::vector<std::uint32_t> held;
    for (const GroupPlace& place : tree.groups) held.push_back(place.mesh_group);
    std::sort(held.begin(), held.end());
    REQUIRE(held.size() == rooms.groups.size());
    for (std::size_t k = 0; k < held.size(); ++k) CHECK(held[k] == rooms.groups[k].value);
  }

  TEST_CASE("receiver_tree: every node bounds what is below it") {
    const TreeOfRooms rooms(0.3);
    const ReceiverTree& tree = rooms.tree;
    for (std::uint32_t n = 0; n < tree.nodes.size(); ++n) {
      const ReceiverNode& node = tree.nodes[n];
      std::uint32_t cluster_count = 0;
      for (std::uint32_t i = node.first_item; i < node.first_item + node.item_count; ++i) {
        const ReceiverItem& item = tree.items[i];
        cluster_count += item.cluster_count;
        for (std::uint32_t c = item.first_cluster; c < item.first_cluster + item.cluster_count; ++c)
          for (int axis = 0; axis < 3; ++axis) {
            REQUIRE(tree.clusters[c].lo[axis] >= node.lo[axis]);
            REQUIRE(tree.clusters[c].hi[axis] <= node.hi[axis]);
          }
      }
      REQUIRE(node.cluster_count == cluster_count);
      if (node.right == 0) {
        REQUIRE(node.item_count == 1);
      } else {
        REQUIRE(tree.nodes[n + 1].item_count + tree.nodes[node.right].item_count == node.item_count);
      }
    }
  }

  TEST_CASE("receiver_tree: no groups make an empty tree") {
    const TreeOfRooms rooms(1.0);
    const ReceiverTree tree = receiver_tree(rooms.mesh, {}, rooms.origin);
    CHECK(tree.clusters.empty());
    CHECK(tree.islands.empty());
  }
}
