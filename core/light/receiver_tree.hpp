/// The receivers of a cell, packed for vectors and rays: clusters of up to 16 elements under a bounding-volume tree.
///
/// Full patches are a cluster of their own, or several where they are refined; patches of few elements share one with their
/// neighbours. A group is never divided between two items, and an item never between two islands, so a task that owns an island
/// owns its groups.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/footprint.hpp"
#include "core/light/group_exchange.hpp"
#include "core/light/kernels/kernels.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

struct Cluster {
  Receivers16 points;
  /// Edges of the elements (m); none where one is no whole rectangle.
  float across[3][16] = {}, along[3][16] = {};
  alignas(64) float area[16];     ///< m²; 0 in empty lanes
  float openness[16] = {};        ///< in [0, 1], 0: veiled; see core/light/openness
  std::uint32_t element[16];      ///< index into Mesh::elements
  std::uint16_t patch[16];        ///< index of the lane's patch, counted from `first_patch`
  std::uint32_t lanes = 0;        ///< bit i: lane i holds a receiver
  std::uint32_t first_patch = 0;  ///< local number of the first patch
  bool single_patch = false;      ///< all lanes belong to one patch
  bool planar = false;            ///< all lanes lie in one plane
  float light = 0;     ///< W/m²; the least that core/light/group_exchange forecasts for a lane, channels summed
  float lo[3], hi[3];  ///< bounds of the points (m, local)
  float width = 0;     ///< m; root of the largest area
};

/// One or more whole groups with their clusters: the unit that islands are made of.
struct ReceiverItem {
  std::uint32_t first_cluster = 0, cluster_count = 0;
  std::uint32_t first_group = 0, group_count = 0;  ///< range of ReceiverTree::groups
};

struct ReceiverNode {
  float lo[3], hi[3];
  std::uint32_t first_item = 0, item_count = 0;
  std::uint32_t right = 0;  ///< index of the second child; the first one follows the node itself; 0: leaf
  std::uint32_t cluster_count = 0;
  float light = 0;  ///< the least of its clusters
};

struct PatchPlace {
  std::uint32_t mesh_patch = 0;     ///< index into Mesh::patches
  std::uint32_t first_cluster = 0;  ///< and as many more as its elements need
  std::uint32_t first_lane = 0;     ///< in the first
  struct Lane {
    std::uint32_t cluster, lane;
  };
  /// Where element k of the patch is.
  Lane lane_of(std::uint32_t k) const { return {first_cluster + (first_lane + k) / 16, (first_lane + k) % 16}; }
};

struct GroupPlace {
  std::uint32_t mesh_group = 0;                    ///< index into Mesh::groups
  std::uint32_t first_patch = 0, patch_count = 0;  ///< range of ReceiverTree::patches
};

struct ReceiverTree {
  std::vector<Cluster> clusters;
  std::vector<ReceiverItem> items;
  std::vector<ReceiverNode> nodes;
  std::vector<GroupPlace> groups;
  std::vector<PatchPlace> patches;
  std::vector<std::uint32_t> islands;  ///< roots of disjoint subtrees that together hold every item: the parallel tasks
  std::size_t memory_bytes() const { return bytes_of_all(clusters, items, nodes, groups, patches, islands); }
};

/// Tells clusters and nodes the light that is forecast for them.
void set_light(ReceiverTree& tree, const GroupExchange& exchange);

/// @param groups  lit groups of the cell
/// @param origin  world point that becomes the local zero (m)
/// @cost O(n log n), about 1 µs per group
ReceiverTree receiver_tree(const Mesh& mesh, std::span<const GroupId> groups, const Vec3& origin);

}  // namespace lichthof
