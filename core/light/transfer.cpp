#include "core/light/transfer.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

namespace {

std::vector<Vec3> world_corners(const Plane& plane, std::span<const Vec2> corners) {
  std::vector<Vec3> world;
  world.reserve(corners.size());
  for (const Vec2& c : corners) world.push_back(plane.point(c));
  return world;
}

template <class PointOfLane>
void set_aims(Aim16& aim, PointOfLane&& point_of_lane) {
  for (int lane = 0; lane < 16; ++lane) {
    const Vec3 point = point_of_lane(lane);
    aim.x[lane] = aim.x[lane + 16] = static_cast<float>(point.x);
    aim.y[lane] = aim.y[lane + 16] = static_cast<float>(point.y);
    aim.z[lane] = aim.z[lane + 16] = static_cast<float>(point.z);
  }
}

/// Aims at elements in proportion to the reflected light that leaves them. Aiming blindly multiplies the mean radiosity by
/// the mean visibility, but what is hidden under furniture is dark as well: the product of means loses several percent.
void aim_where_light_leaves(FlatSource& source, std::span<const FlatSource> elements, std::span<const float> areas) {
  std::array<float, 64> up_to;
  float total = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const float* light = elements[e].reflected;
    total += areas[e] * (std::abs(light[0]) + std::abs(light[1]) + std::abs(light[2]));
    up_to[e] = total;
  }
  if (!(total > 0)) return;
  set_aims(source.aim, [&](int lane) {
    // Strata of equal power; neighbouring lanes take strata far apart.
    const float wanted = (static_cast<float>(lane * 5 & 15) + 0.5f) / 16.f * total;
    const auto found = std::lower_bound(up_to.begin(), up_to.begin() + static_cast<std::ptrdiff_t>(elements.size()) - 1, wanted);
    const FlatShooter& f = elements[static_cast<std::size_t>(found - up_to.begin())].flat;
    return Vec3{f.cx, f.cy, f.cz};
  });
}

FlatSource source_of(const Plane& plane, std::span<const Vec2> corners, const Vec3& origin, const Rgbf& reflected,
                     const Rgbf& emitted) {
  FlatSource source;
  source.flat = flat_shooter(world_corners(plane, corners), plane.normal, origin);
  set_aims(source.aim, [&](int) { return Vec3{source.flat.cx, source.flat.cy, source.flat.cz}; });
  for (int c = 0; c < 3; ++c) source.reflected[c] = reflected[c], source.emitted[c] = emitted[c];
  const FlatShooter& f = source.flat;
  for (int k = 0; k < f.count; ++k) {
    const float x = f.x[k] - f.cx, y = f.y[k] - f.cy, z = f.z[k] - f.cz;
    source.radius = std::max(source.radius, std::sqrt(x * x + y * y + z * z));
  }
  return source;
}

/// Polygon of one grid place of a shooting patch; a rectangle where the patch is one.
void element_corners(const ShotPatch& patch, int column, int row, bool rectangular, Polygon2& corners) {
  const Vec2 step = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
  const Vec2 lo = patch.lo + step * Vec2{column, row}, hi = lo + step;
  corners = {lo, {hi.x, lo.y}, hi, {lo.x, hi.y}};
  if (rectangular) return;
  const double slack = 1e-9 * (step.x + step.y);
  Polygon2 piece = patch.corners;
  piece = clipped(piece, Vec2{1, 0}, lo.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{-1, 0}, -hi.x, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, 1}, lo.y, slack);
  if (!piece.empty()) piece = clipped(piece, Vec2{0, -1}, -hi.y, slack);
  corners = std::move(piece);
}

}  // namespace

LocalShot local_shot(const Shot& shot, const Vec3& origin) {
  LocalShot local;
  Rgbf group_reflected{0.f}, group_emitted{0.f};
  float group_area = 0;
  local.first_element.push_back(0);
  std::vector<float> areas;
  Polygon2 corners;
  for (const ShotPatch& patch : shot.patches) {
    float area = 0;
    for (const float a : patch.area) area += a;
    group_reflected += area * patch.reflected;
    group_emitted += area * patch.emitted;
    group_area += area;
    local.emits |= patch.emitted != Rgbf{0.f};
    local.patches.push_back(source_of(shot.plane, patch.corners, origin, patch.reflected, patch.emitted));
    const Vec2 size = patch.hi - patch.lo;
    const bool rectangular =
        patch.corners.size() == 4 && std::abs(signed_area(patch.corners) - size.x * size.y) <= 1e-9 * size.x * size.y;
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) {
        const std::size_t place = static_cast<std::size_t>(row) * patch.columns + static_cast<std::size_t>(column);
        if (patch.area[place] <= 0) continue;
        element_corners(patch, column, row, rectangular, corners);
        if (corners.size() < 3) continue;
        local.reflects |= patch.delta[place] != patch.emitted;
        local.elements.push_back(source_of(shot.plane, corners, origin, patch.delta[place] - patch.emitted, patch.emitted));
        areas.push_back(patch.area[place]);
      }
    const std::size_t first = local.first_element.back();
    aim_where_light_leaves(local.patches.back(), std::span(local.elements).subspan(first), std::span(areas).subspan(first));
    local.first_element.push_back(static_cast<std::uint32_t>(local.elements.size()));
  }
  local.group = source_of(shot.plane, shot.corners, origin, group_reflected / group_area, group_emitted / group_area);
  aim_where_light_leaves(local.group, local.elements, areas);
  return local;
}

namespace {

float distance_to_box(const FlatShooter& f, const float (&lo)[3], const float (&hi)[3]) {
  const float p[3] = {f.cx, f.cy, f.cz};
  float square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float d = std::max({lo[axis] - p[axis], 0.f, p[axis] - hi[axis]});
    square += d * d;
  }
  return std::sqrt(square);
}

/// The work of one island: every item of one subtree, on one thread.
class IslandTask {
 public:
  IslandTask(const LocalShot& shot, const HemicubeBitmap* incoming, const ItemVisibility* items, const HemicubeFrame& frame,
             const TransferScene& scene, Radiosity& light)
      : shot_(shot), incoming_(incoming), items_(items), scene_(scene), light_(light), offset_(static_cast<float>(scene.rays.offset())) {
    clear_segments(factors_.segments);
    const Vec3 centre = frame.centre - scene.origin;
    for (int axis = 0; axis < 3; ++axis) {
      centre_[axis] = static_cast<float>(centre[axis]);
      tangent_[axis] = static_cast<float>(frame.tangent[axis]);
      bitangent_[axis] = static_cast<float>(frame.bitangent[axis]);
      normal_[axis] = static_cast<float>(frame.normal[axis]);
    }
    plane_ = centre_[0] * normal_[0] + centre_[1] * normal_[1] + centre_[2] * normal_[2];
  }

  TransferWork run(std::uint32_t root) {
    visit(root);
    return work_;
  }

 private:
  /// True when the box does not reach in front of the shooter's plane.
  bool behind(const float (&lo)[3], const float (&hi)[3]) const {
    float furthest = 0;
    for (int axis = 0; axis < 3; ++axis) furthest += normal_[axis] * (normal_[axis] > 0 ? hi[axis] : lo[axis]);
    return furthest <= plane_ + offset_;
  }

  /// One convex surface hides the whole box from the whole shooter: one that hid something before, or whatever the ray to
  /// the middle of the box meets first.
  bool hidden(const ReceiverNode& node) {
    const FlatShooter& f = shot_.group.flat;
    alignas(32) float box[3][8];
    const float margin = 2 * offset_;
    for (int k = 0; k < 8; ++k)
      for (int axis = 0; axis < 3; ++axis)
        box[axis][k] = (k >> axis) & 1 ? node.hi[axis] + margin : node.lo[axis] - margin;
    for (int k = 0; k < known_count_; ++k)
      if (kernels_.hidden8(box, f, scene_.occluders[known_[k]].polygon, margin)) return true;
    if (node.cluster_count < clusters_worth_a_ray) return false;
    const Vec3 from = Vec3{f.cx, f.cy, f.cz} + 2.0 * offset_ * Vec3{f.nx, f.ny, f.nz} + scene_.origin;
    const Vec3 to = 0.5 * Vec3{node.lo[0] + node.hi[0], node.lo[1] + node.hi[1], node.lo[2] + node.hi[2]} + scene_.origin;
    const std::optional<Hit> hit = scene_.rays.nearest(from, to - from, 0.9999);
    ++work_.rays;
    if (!hit) return false;
    remember(hit->surface);
    return kernels_.hidden8(box, f, scene_.occluders[hit->surface].polygon, margin);
  }

  void visit(std::uint32_t index) {
    const ReceiverNode& node = scene_.tree.nodes[index];
    if (behind(node.lo, node.hi)) return;
    if (!items_ && node.cluster_count >= clusters_worth_a_test && hidden(node)) {
      work_.clusters_hidden += node.cluster_count;
      return;
    }
    if (node.right != 0) {
      visit(index + 1);
      visit(node.right);
      return;
    }
    const ReceiverItem& item = scene_.tree.items[node.first_item];
    bool touched = false;
    for (std::uint32_t c = item.first_cluster; c < item.first_cluster + item.cluster_count; ++c) touched |= receive(c);
    if (!touched) return;
    for (std::uint32_t g = item.first_group; g < item.first_group + item.group_count; ++g) light_.update_group(g);
  }

  bool receive(std::uint32_t index) {
    const Cluster& cluster = scene_.tree.clusters[index];
    if (behind(cluster.lo, cluster.hi)) return false;
    if (cluster.planar && faces_away(cluster)) return false;
    ++work_.clusters_tested;
    if (items_) return receive_by_items(cluster, index);
    const float group_distance = distance_to_box(shot_.group.flat, cluster.lo, cluster.hi);
    if (can_not_matter(cluster, group_distance)) {
      ++work_.clusters_cut;
      return false;
    }
    // Reflected light: the level of detail follows from the distance alone. It must never change from shot to shot: what a
    // receiver got of single elements earlier would not fit what it gets of their mean later.
    const TransferOptions& options = scene_.options;
    const bool near_group = group_distance <= static_cast<float>(options.group_factor) * shot_.group.radius;
    bool touched = false;
    if (!near_group && shot_.reflects) touched = add(cluster, index, shot_.group, Part::reflected);
    if (!near_group && !shot_.emits) return touched;
    for (std::size_t p = 0; p < shot_.patches.size(); ++p) {
      const FlatSource& patch = shot_.patches[p];
      const bool near = near_group && distance_to_box(patch.flat, cluster.lo, cluster.hi) <=
                                          static_cast<float>(1 + options.near_factor) * patch.radius;
      if (near_group && !near && shot_.reflects) touched |= add(cluster, index, patch, Part::reflected);
      // A luminaire is always seen element by element: its shadow edges carry most of the picture's detail.
      if (!shot_.emits && !near) continue;
      const Part part = !shot_.emits ? Part::reflected : near && shot_.reflects ? Part::both : Part::emitted;
      for (std::uint32_t e = shot_.first_element[p]; e < shot_.first_element[p + 1]; ++e)
        touched |= add(cluster, index, shot_.elements[e], part);
    }
    return touched;
  }

  /// The paper's transfer: patch by patch, each receiver seen or not from the centre of the shooting patch.
  bool receive_by_items(const Cluster& cluster, std::uint32_t index) {
    bool touched = false;
    for (std::size_t p = 0; p < shot_.patches.size(); ++p) {
      item_patch_ = p;
      const Part part = !shot_.emits ? Part::reflected : shot_.reflects ? Part::both : Part::emitted;
      touched |= add(cluster, index, shot_.patches[p], part);
    }
    return touched;
  }

  void look_up_items(const Cluster& cluster, std::uint32_t seen) {
    const Receivers16& r = cluster.points;
    for (int lane = 0; lane < 16; ++lane) {
      if (!((seen >> lane) & 1)) continue;
      const PatchPlace& place = scene_.tree.patches[cluster.first_patch + cluster.patch[lane]];
      const Vec3 point = Vec3{r.x[lane], r.y[lane], r.z[lane]} + scene_.origin;
      if (!items_->sees(item_patch_, point, scene_.mesh.patches[place.mesh_patch].plane.value))
        factors_.segments.tfar[lane] = -1.f;
    }
  }

  /// No point of the shooter is nearer than `distance` minus its radius, and no cosine is above 1.
  bool can_not_matter(const Cluster& cluster, float distance) const {
    const float nearest = distance - shot_.group.radius;
    constexpr float pi = 3.14159265f;
    return nearest > 0 && cluster.total_area < static_cast<float>(scene_.options.contribution_cut) * pi * nearest * nearest;
  }

  bool faces_away(const Cluster& cluster) const {
    const Receivers16& r = cluster.points;
    const FlatShooter& f = shot_.group.flat;
    const float height = (f.cx - r.x[0]) * r.nx[0] + (f.cy - r.y[0]) * r.ny[0] + (f.cz - r.z[0]) * r.nz[0];
    return height + shot_.group.radius <= 0;
  }

  enum class Part { reflected, emitted, both };

  /// Transfer from one polygon into one cluster. @returns whether anything arrived
  bool add(const Cluster& cluster, std::uint32_t index, const FlatSource& source, Part part) {
    const std::uint32_t seen = kernels_.factor16(cluster.points, cluster.lanes, source.flat, source.aim,
                                                 static_cast<int>(index * 7 & 15), offset_, factors_);
    if (seen == 0) return false;
    work_.form_factors += 16;
    if (incoming_ && !apply_bitmap(cluster)) return false;
    if (items_) look_up_items(cluster, seen);
    else trace_shadows(seen);

    ClusterLight& light = light_.clusters[index];
    float delta[3];
    for (int c = 0; c < 3; ++c)
      delta[c] = part == Part::reflected ? source.reflected[c]
                 : part == Part::emitted ? source.emitted[c]
                                         : source.reflected[c] + source.emitted[c];
    const float received_area = kernels_.accumulate16(factors_, cluster.area, delta, light.received);
    if (received_area <= 0.f) return false;
    if (part != Part::reflected) kernels_.accumulate16(factors_, nullptr, source.emitted, light.direct);
    credit(cluster, Rgb{delta[0], delta[1], delta[2]}, received_area);
    return true;
  }

  /// Blocked lanes get a negative tfar. What stood in the way of the neighbours is tried first: where most is hidden, few
  /// packets need the ray tracer at all.
  void trace_shadows(std::uint32_t seen) {
    for (int k = 0; k < known_count_; ++k)
      if (!kernels_.block16(scene_.occluders[known_[k]], factors_.segments, factors_.seen)) {
        std::swap(known_[k], known_[k / 2]);
        work_.rays_saved += static_cast<std::uint64_t>(__builtin_popcount(seen));
        return;
      }
    scene_.rays.occluded16(factors_.segments, factors_.seen);
    work_.rays += static_cast<std::uint64_t>(__builtin_popcount(seen));
    const Segments16& s = factors_.segments;
    for (int lane = 0; lane < 16; ++lane)
      if ((seen >> lane & 1) && s.tfar[lane] >= 0.f) return;
    // Everything is blocked: learn by what.
    const int lane = __builtin_ctz(seen);
    const std::optional<Hit> hit = scene_.rays.nearest(Vec3{s.ox[lane], s.oy[lane], s.oz[lane]} + scene_.origin,
                                                       Vec3{s.dx[lane], s.dy[lane], s.dz[lane]}, 1.0);
    ++work_.rays;
    if (hit) remember(hit->surface);
  }

  /// The newest known occluder replaces the one that helped least recently.
  void remember(std::uint32_t occluder) {
    for (int k = 0; k < known_count_; ++k)
      if (known_[k] == occluder) return;
    if (known_count_ < most_known) ++known_count_;
    for (int k = known_count_ - 1; k > 0; --k) known_[k] = known_[k - 1];
    known_[0] = occluder;
  }

  /// Adds what arrived to the sums of the patches and of the shot (W).
  void credit(const Cluster& cluster, const Rgb& delta, float received_area) {
    if (cluster.single_patch) {
      const Rgb power = static_cast<double>(received_area) * delta;
      light_.patches[cluster.first_patch + cluster.patch[0]].received_w += power;
      work_.received += power;
      return;
    }
    for (int lane = 0; lane < 16; ++lane) {
      const Rgb power = static_cast<double>(factors_.factor[lane] * cluster.area[lane]) * delta;
      light_.patches[cluster.first_patch + cluster.patch[lane]].received_w += power;
      work_.received += power;
    }
  }

  bool apply_bitmap(const Cluster& cluster) {
    alignas(64) float x[16], y[16], z[16], visible[16];
    const Receivers16& r = cluster.points;
    for (int lane = 0; lane < 16; ++lane) {
      const float dx = r.x[lane] - centre_[0], dy = r.y[lane] - centre_[1], dz = r.z[lane] - centre_[2];
      x[lane] = dx * tangent_[0] + dy * tangent_[1] + dz * tangent_[2];
      y[lane] = dx * bitangent_[0] + dy * bitangent_[1] + dz * bitangent_[2];
      z[lane] = dx * normal_[0] + dy * normal_[1] + dz * normal_[2];
    }
    incoming_->visibility16(x, y, z, visible);
    bool any = false;
    for (int lane = 0; lane < 16; ++lane) {
      factors_.factor[lane] *= visible[lane];
      any |= factors_.factor[lane] > 0.f;
    }
    return any;
  }

  const LocalShot& shot_;
  const HemicubeBitmap* incoming_;
  const ItemVisibility* items_;     ///< method `hemicube`; null: shadow rays
  std::size_t item_patch_ = 0;
  const TransferScene& scene_;
  Radiosity& light_;
  const Kernels& kernels_ = kernels();
  float offset_, plane_ = 0;
  float centre_[3], tangent_[3], bitangent_[3], normal_[3];
  Factors16 factors_;
  TransferWork work_;
  static constexpr std::uint32_t clusters_worth_a_test = 3, clusters_worth_a_ray = 8;
  static constexpr int most_known = 4;
  std::uint32_t known_[most_known] = {};
  int known_count_ = 0;
};

}  // namespace

TransferWork transfer(const Shot& shot, const HemicubeBitmap* incoming, const TransferScene& scene, Radiosity& light,
                      const Parallel& parallel) {
  const LocalShot local = local_shot(shot, scene.origin);
  const HemicubeFrame frame = shot.frame();
  std::optional<ItemVisibility> items;
  if (scene.options.method == TransferMethod::hemicube)
    items.emplace(shot, scene.outlines, incoming, scene.options.hemicube_resolution, parallel);
  const std::vector<std::uint32_t>& islands = scene.tree.islands;
  std::vector<TransferWork> parts(islands.size());
  parallel.for_each(islands.size(), [&](std::size_t i) {
    parts[i] = IslandTask(local, incoming, items ? &*items : nullptr, frame, scene, light).run(islands[i]);
  });
  // Summed in the order of the islands, so that the total does not depend on the threads.
  TransferWork total;
  for (const TransferWork& part : parts) {
    total.rays += part.rays;
    total.rays_saved += part.rays_saved;
    total.form_factors += part.form_factors;
    total.clusters_tested += part.clusters_tested;
    total.clusters_hidden += part.clusters_hidden;
    total.clusters_cut += part.clusters_cut;
    total.received += part.received;
  }
  return total;
}

}  // namespace lichthof
