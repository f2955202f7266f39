#include "core/light/receiver_tree.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"
#include "core/base/ties.hpp"

namespace lichthof {

namespace {

/// Clusters per parallel task: small enough to share out evenly, large enough to outweigh the hand-over (about 1 µs).
constexpr std::uint32_t island_clusters = 24;

std::uint32_t element_count(const Mesh& mesh, const Group& group) {
  std::uint32_t count = 0;
  for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
    count += mesh.patches[p].element_count;
  return count;
}

/// Interleaved bits of a point in a box, 21 bits an axis (a Morton code): neighbours in space become neighbours in a list.
std::uint64_t morton_code(const Vec3& point, const Box& box, int bits) {
  std::uint64_t code = 0;
  std::uint32_t cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double size = std::max(box.size()[axis], 1e-300);
    const double place = std::clamp((point[axis] - box.lo[axis]) / size, 0.0, 1.0) * ((1u << bits) - 1);
    cell[axis] = static_cast<std::uint32_t>(place + tie_share);  // a whole number is not made less by rounding
  }
  for (int bit = bits - 1; bit >= 0; --bit)
    for (const std::uint32_t c : cell) code = code << 1 | ((c >> bit) & 1);
  return code;
}

class Builder {
 public:
  Builder(const Mesh& mesh, const Vec3& origin) : mesh_(mesh), origin_(origin) {}

  ReceiverTree build(std::span<const GroupId> groups) {
    std::vector<Bundle> bundles = bundles_of(groups);
    if (bundles.empty()) return std::move(tree_);
    add_node(bundles, 0, bundles.size());
    choose_islands(0);
    return std::move(tree_);
  }

 private:
  /// What becomes one item: a large group, or several small neighbours that fill one cluster.
  struct Bundle {
    std::vector<GroupId> groups;
    Box box;
    Vec3 centre{0.0};
    std::uint32_t clusters = 1;
  };

  /// Whether a patch goes on where another ends, or begins a cluster. @param lane  after the last one's; 0: there is none
  static bool shares_cluster(std::uint32_t element_count, std::uint32_t lane) {
    return lane > 0 && lane + element_count <= 16;
  }

  void finish(Bundle& bundle) const {
    for (const GroupId id : bundle.groups)
      for (const Vec2& corner : mesh_.polygon(mesh_.groups[id.value].polygon))
        bundle.box.include(mesh_.planes[mesh_.groups[id.value].plane.value].point(corner));
    bundle.centre = bundle.box.centre();
  }

  std::vector<Bundle> bundles_of(std::span<const GroupId> groups) const {
    std::vector<Bundle> bundles;
    std::vector<GroupId> small;
    Box all;
    for (const GroupId id : groups) {
      const Group& group = mesh_.groups[id.value];
      all.include(group.centre);
      if (element_count(mesh_, group) < 10) {
        small.push_back(id);
        continue;
      }
      Bundle bundle{{id}, {}, {}, 0};
      std::uint32_t lane = 0;
      for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
        const std::uint32_t count = mesh_.patches[p].element_count;
        if (!shares_cluster(count, lane)) ++bundle.clusters, lane = 0;
        bundle.clusters += (lane + count - 1) / 16;
        lane = (lane + count - 1) % 16 + 1;
      }
      finish(bundle);
      bundles.push_back(std::move(bundle));
    }
    pack_small(small, all, bundles);
    return bundles;
  }

  /// Small groups share a cluster with neighbours that face the same way, as far as there are any.
  void pack_small(std::vector<GroupId>& small, const Box& all, std::vector<Bundle>& bundles) const {
    struct Keyed {
      std::uint64_t place;
      int facing;
      std::uint64_t fine;
      GroupId id;
    };
    std::vector<Keyed> keyed;
    const double extent = std::max({all.size().x, all.size().y, all.size().z, 1e-300});
    // Coarse places about two patches wide: within one of them order is by facing, so that lanes live and die together.
    const int coarse_bits = std::clamp(static_cast<int>(std::log2(extent / (2 * mesh_.options.patch_size))), 0, 20);
    Box cube{all.centre() - 0.5 * extent, all.centre() + 0.5 * extent};
    for (const GroupId id : small) {
      const Group& group = mesh_.groups[id.value];
      const Vec3& n = mesh_.planes[group.plane.value].normal;
      int facing = 0;
      for (int axis = 1; axis < 3; ++axis)
        if (exceeds(std::abs(n[axis]), std::abs(n[facing]))) facing = axis;
      facing = 2 * facing + (n[facing] > 0);
      keyed.push_back({morton_code(group.centre, cube, coarse_bits), facing, morton_code(group.centre, cube, 20), id});
    }
    std::sort(keyed.begin(), keyed.end(), [](const Keyed& a, const Keyed& b) {
      return std::tie(a.place, a.facing, a.fine, a.id) < std::tie(b.place, b.facing, b.fine, b.id);
    });
    std::vector<Bundle> packed;
    std::uint32_t lanes = 17;
    std::uint64_t place = 0;
    for (const Keyed& k : keyed) {
      const std::uint32_t count = element_count(mesh_, mesh_.groups[k.id.value]);
      if (lanes + count > 16 || k.place != place) {
        packed.push_back({{}, {}, {}, 1});
        lanes = 0;
        place = k.place;
      }
      packed.back().groups.push_back(k.id);
      lanes += count;
    }
    for (Bundle& bundle : packed) finish(bundle);
    bundles.insert(bundles.end(), packed.begin(), packed.end());
  }

  std::uint32_t add_node(std::vector<Bundle>& bundles, std::size_t first, std::size_t last) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.emplace_back();
    Box centres;
    std::uint32_t clusters = 0;
    for (std::size_t b = first; b < last; ++b) centres.include(bundles[b].centre), clusters += bundles[b].clusters;
    const auto first_item = static_cast<std::uint32_t>(tree_.items.size());
    std::uint32_t right = 0;
    if (last - first == 1) {
      add_item(bundles[first]);
    } else {
      int axis = 0;
      for (int a = 1; a < 3; ++a)
        if (exceeds(centres.size()[a], centres.size()[axis])) axis = a;
      const double step = 10 * tie_share * std::max(centres.size()[axis], 1e-300);
      const auto place = [&](const Bundle& bundle) { return step_of(bundle.centre[axis] - centres.lo[axis], step); };
      const std::size_t middle = first + (last - first) / 2;
      std::nth_element(bundles.begin() + static_cast<std::ptrdiff_t>(first),
                       bundles.begin() + static_cast<std::ptrdiff_t>(middle),
                       bundles.begin() + static_cast<std::ptrdiff_t>(last), [&](const Bundle& a, const Bundle& b) {
                         return std::pair(place(a), a.groups[0]) < std::pair(place(b), b.groups[0]);
                       });
      add_node(bundles, first, middle);
      right = add_node(bundles, middle, last);
    }
    ReceiverNode& node = tree_.nodes[index];
    node.first_item = first_item;
    node.item_count = static_cast<std::uint32_t>(tree_.items.size()) - first_item;
    node.right = right;
    node.cluster_count = clusters;
    for (int axis = 0; axis < 3; ++axis) node.lo[axis] = 3e38f, node.hi[axis] = -3e38f;
    for (std::uint32_t i = node.first_item; i < node.first_item + node.item_count; ++i)
      for (std::uint32_t c = tree_.items[i].first_cluster;
           c < tree_.items[i].first_cluster + tree_.items[i].cluster_count; ++c)
        for (int axis = 0; axis < 3; ++axis) {
          node.lo[axis] = std::min(node.lo[axis], tree_.clusters[c].lo[axis]);
          node.hi[axis] = std::max(node.hi[axis], tree_.clusters[c].hi[axis]);
        }
    return index;
  }

  void add_item(const Bundle& bundle) {
    ReceiverItem item;
    item.first_cluster = static_cast<std::uint32_t>(tree_.clusters.size());
    item.first_group = static_cast<std::uint32_t>(tree_.groups.size());
    item.group_count = static_cast<std::uint32_t>(bundle.groups.size());
    std::uint32_t lane = 0;
    for (const GroupId id : bundle.groups) {
      const Group& group = mesh_.groups[id.value];
      tree_.groups.push_back({id.value, static_cast<std::uint32_t>(tree_.patches.size()), group.patch_count});
      for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
        if (!shares_cluster(mesh_.patches[p].element_count, lane)) {
          tree_.clusters.emplace_back();
          tree_.clusters.back().first_patch = static_cast<std::uint32_t>(tree_.patches.size());
          lane = 0;
        }
        add_patch(p, lane);
      }
    }
    item.cluster_count = static_cast<std::uint32_t>(tree_.clusters.size()) - item.first_cluster;
    for (std::uint32_t c = item.first_cluster; c < item.first_cluster + item.cluster_count; ++c)
      close(tree_.clusters[c]);
    tree_.items.push_back(item);
  }

  void add_patch(std::uint32_t mesh_patch, std::uint32_t& lane) {
    const Patch& patch = mesh_.patches[mesh_patch];
    const Plane& plane = mesh_.planes[patch.plane.value];
    tree_.patches.push_back({mesh_patch, static_cast<std::uint32_t>(tree_.clusters.size()) - 1, lane});
    const auto place = static_cast<std::uint32_t>(tree_.patches.size()) - 1;
    MUST(lane == 0 || lane + patch.element_count <= 16);
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e, ++lane) {
      if (lane == 16) {
        tree_.clusters.emplace_back();
        tree_.clusters.back().first_patch = place;
        lane = 0;
      }
      Cluster& cluster = tree_.clusters.back();
      const auto local_patch = static_cast<std::uint16_t>(place - cluster.first_patch);
      const Vec3 point = plane.point(mesh_.elements[e].centre) - origin_;
      Receivers16& r = cluster.points;
      r.x[lane] = static_cast<float>(point.x), r.y[lane] = static_cast<float>(point.y),
      r.z[lane] = static_cast<float>(point.z);
      r.nx[lane] = static_cast<float>(plane.normal.x), r.ny[lane] = static_cast<float>(plane.normal.y);
      r.nz[lane] = static_cast<float>(plane.normal.z);
      cluster.area[lane] = mesh_.elements[e].area;
      set_edges(cluster, lane, patch, mesh_.elements[e]);
      cluster.element[lane] = e;
      cluster.patch[lane] = local_patch;
      cluster.lanes |= 1u << lane;
    }
  }

  void set_edges(Cluster& cluster, std::uint32_t lane, const Patch& patch, const Element& element) const {
    const Plane& plane = mesh_.planes[patch.plane.value];
    Vec2 lo, hi;
    mesh_.element_rectangle(patch, element, lo, hi);
    const Vec2 size = hi - lo;
    if (std::abs(size.x * size.y - static_cast<double>(element.area)) > 1e-5 * size.x * size.y) return;
    for (int axis = 0; axis < 3; ++axis) {
      cluster.across[axis][lane] = static_cast<float>(size.x * plane.u[axis]);
      cluster.along[axis][lane] = static_cast<float>(size.y * plane.v[axis]);
    }
  }

  /// Fills the empty lanes with copies of the first (harmless to compute with) and takes the bounds.
  void close(Cluster& cluster) const {
    Receivers16& r = cluster.points;
    cluster.single_patch = cluster.planar = true;
    for (int lane = 0; lane < 16; ++lane) {
      if (!((cluster.lanes >> lane) & 1)) {
        r.x[lane] = r.x[0], r.y[lane] = r.y[0], r.z[lane] = r.z[0];
        r.nx[lane] = r.nx[0], r.ny[lane] = r.ny[0], r.nz[lane] = r.nz[0];
        cluster.area[lane] = 0;
        cluster.element[lane] = cluster.element[0];
        cluster.patch[lane] = cluster.patch[0];
      }
      cluster.single_patch &= cluster.patch[lane] == cluster.patch[0];
    }
    cluster.width = std::sqrt(*std::max_element(cluster.area, cluster.area + 16));
    const float* coordinate[3] = {r.x, r.y, r.z};
    for (int axis = 0; axis < 3; ++axis) {
      cluster.lo[axis] = 3e38f, cluster.hi[axis] = -3e38f;
      for (int lane = 0; lane < 16; ++lane) {
        const float half = 0.5f * (std::abs(cluster.across[axis][lane]) + std::abs(cluster.along[axis][lane]));
        cluster.lo[axis] = std::min(cluster.lo[axis], coordinate[axis][lane] - half);
        cluster.hi[axis] = std::max(cluster.hi[axis], coordinate[axis][lane] + half);
      }
    }
    const std::uint32_t plane =
        mesh_.patches[tree_.patches[cluster.first_patch + cluster.patch[0]].mesh_patch].plane.value;
    for (const std::uint16_t p : cluster.patch)
      cluster.planar &= mesh_.patches[tree_.patches[cluster.first_patch + p].mesh_patch].plane.value == plane;
  }

  void choose_islands(std::uint32_t node) {
    const ReceiverNode& n = tree_.nodes[node];
    if (n.cluster_count <= island_clusters || n.right == 0) {
      tree_.islands.push_back(node);
      return;
    }
    choose_islands(node + 1);
    choose_islands(tree_.nodes[node].right);
  }

  const Mesh& mesh_;
  Vec3 origin_;
  ReceiverTree tree_;
};

}  // namespace

ReceiverTree receiver_tree(const Mesh& mesh, std::span<const GroupId> groups, const Vec3& origin) {
  return Builder(mesh, origin).build(groups);
}

void set_light(ReceiverTree& tree, const GroupExchange& exchange) {
  constexpr float unknown = 3e38f;
  for (Cluster& cluster : tree.clusters) cluster.light = unknown;
  std::vector<float> of_patch(tree.patches.size());
  for (const GroupPlace& group : tree.groups)
    std::fill_n(of_patch.begin() + group.first_patch, group.patch_count,
                static_cast<float>(exchange.irradiance(group.mesh_group)));
  for (Cluster& cluster : tree.clusters)
    for (int lane = 0; lane < 16; ++lane)
      if (cluster.lanes >> lane & 1)
        cluster.light = std::min(cluster.light, of_patch[cluster.first_patch + cluster.patch[lane]]);
  for (ReceiverNode& node : tree.nodes) {
    node.light = unknown;
    for (std::uint32_t i = node.first_item; i < node.first_item + node.item_count; ++i)
      for (std::uint32_t c = tree.items[i].first_cluster; c < tree.items[i].first_cluster + tree.items[i].cluster_count;
           ++c)
        node.light = std::min(node.light, tree.clusters[c].light);
  }
}

}  // namespace lichthof
