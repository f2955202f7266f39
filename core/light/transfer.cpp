#include "core/light/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/random.hpp"
#include "core/light/local_shot.hpp"
#include "core/light/near_field.hpp"

namespace lichthof {

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

/// How finely all receivers see the emission of a luminaire, at least.
///
/// Element by element, for its shadow edges carry most of a picture's detail: but a luminaire of many patches is sampled well
/// enough by those, and a luminous ceiling by its groups. So the rays of a receiver stay some hundred however small elements
/// are, and the work grows with the receivers alone.
ShotPart::Level detail_of_luminaire(const Mesh& mesh, GroupId id) {
  constexpr std::uint32_t enough = 32;
  const Group& own = mesh.groups[id.value];
  const auto is_part = [&](std::uint32_t g) {
    return mesh.groups[g].surface == own.surface && mesh.groups[g].back == own.back;
  };
  // The groups of a side lie one after the other; `enough` of them decide, however many there are.
  std::uint32_t groups = 1, patches = own.patch_count;
  const auto count = [&](std::uint32_t g) {
    ++groups;
    patches += mesh.groups[g].patch_count;
  };
  for (std::uint32_t g = id.value; g > 0 && groups < enough && is_part(g - 1); --g) count(g - 1);
  for (std::uint32_t g = id.value + 1; g < mesh.groups.size() && groups < enough && is_part(g); ++g) count(g);
  using enum ShotPart::Level;
  return groups >= enough ? branch : patches >= enough ? patch : element;
}

/// One shot as all tasks see it.
struct ShotView {
  ShotView(const Shot& shot, const HemicubeBitmap* incoming_, const TransferScene& scene, const Parallel& parallel)
      : local(local_shot(shot, scene.origin)), incoming(incoming_), offset(static_cast<float>(scene.rays.offset())) {
    const HemicubeFrame frame = shot.frame();
    const Vec3 middle = frame.centre - scene.origin;
    for (int axis = 0; axis < 3; ++axis) {
      centre[axis] = static_cast<float>(middle[axis]);
      tangent[axis] = static_cast<float>(frame.tangent[axis]);
      bitangent[axis] = static_cast<float>(frame.bitangent[axis]);
      normal[axis] = static_cast<float>(frame.normal[axis]);
    }
    plane = centre[0] * normal[0] + centre[1] * normal[1] + centre[2] * normal[2];
    is_luminaire = glm::length(scene.mesh.patches[scene.mesh.groups[shot.group.value].first_patch].exitance) > 0;
    group = shot.group.value;
    radiosity = static_cast<float>(scene.exchange.radiosity(shot.group.value));
    if (local.emits) emission = detail_of_luminaire(scene.mesh, shot.group);
    if (scene.options.method == TransferMethod::hemicube)
      items.emplace(shot, scene.outlines, incoming, scene.options.hemicube_resolution, parallel);
    else
      shadows.emplace(local.group().flat, scene.occluders, scene.in_hulls);
  }

  /// True when the box does not reach in front of the shooter's plane.
  bool behind(const float (&lo)[3], const float (&hi)[3]) const {
    float furthest = 0;
    for (int axis = 0; axis < 3; ++axis) furthest += normal[axis] * (normal[axis] > 0 ? hi[axis] : lo[axis]);
    return furthest <= plane + offset;
  }

  LocalShot local;
  const HemicubeBitmap* incoming;
  ShotPart::Level emission = ShotPart::Level::element;  ///< no coarser than this
  std::uint32_t group = 0;                              ///< its number
  float radiosity = 0;        ///< forecast for the group (W/m², channels summed): the same for all of its shots
  bool is_luminaire = false;  ///< of the mesh, whether this shot emits or not
  std::optional<ShadowShooter> shadows;
  std::optional<ItemVisibility> items;  ///< method `hemicube`, instead of shadows
  float offset, plane = 0;
  float centre[3], tangent[3], bitangent[3], normal[3];
};

/// What shadow rays answered in one island: asked anew and noted, or read from the notes of an earlier shot.
class IslandAnswers {
 public:
  void note_in(std::vector<std::uint16_t>& notes) { notes_ = &notes; }
  void read(std::span<const std::uint16_t> known) { known_ = known, reads_ = true; }

  template <class Ask>
  std::uint32_t answer(Ask&& ask) {
    if (reads_) {
      MUST(next_ < known_.size());
      return known_[next_++];
    }
    const std::uint32_t answer = ask();
    if (notes_) notes_->push_back(static_cast<std::uint16_t>(answer));
    return answer;
  }

  bool are_read() const { return reads_; }

 private:
  std::vector<std::uint16_t>* notes_ = nullptr;
  std::span<const std::uint16_t> known_;
  std::size_t next_ = 0;
  bool reads_ = false;
};

/// The work of one island: every item of one subtree, on one thread.
class IslandTask {
 public:
  IslandTask(const ShotView& shot, const TransferScene& scene, Radiosity& light, const IslandAnswers& answers)
      : view_(shot), shot_(shot.local), scene_(scene), light_(light), answers_(answers) {
    clear_segments(factors_.segments);
    std::fill_n(visible_, 16, 1.f);
    if (view_.shadows) shadows_.emplace(*view_.shadows, scene.occluders, scene.rays, scene.in_hulls, scene.observer);
  }

  TransferWork run(std::uint32_t root) {
    const ReceiverNode& node = scene_.tree.nodes[root];
    if (!skipped(node)) {
      if (shadows_ && !answers_.are_read()) shadows_->enter_island(box_of(node));
      visit(root);
    }
    for (const std::uint32_t i : touched_items_) {
      const ReceiverItem& item = scene_.tree.items[i];
      for (std::uint32_t g = item.first_group; g < item.first_group + item.group_count; ++g) light_.update_group(g);
    }
    if (shadows_) work_.rays += shadows_->rays(), work_.rays_saved += shadows_->rays_saved();
    return work_;
  }

 private:
  /// Nothing under the node can see the shooter, or gets anything worth adding.
  bool skipped(const ReceiverNode& node) {
    if (view_.behind(node.lo, node.hi)) {
      work_.clusters_behind += node.cluster_count;
      return true;
    }
    if (const float distance = distance_to_box(shot_.group().flat, node.lo, node.hi);
        distance > shot_.group().radius + scene_.reach &&
        share_of_light(shot_.group(), distance, node.light) < least_share) {
      work_.clusters_cut += node.cluster_count;
      return true;
    }
    if (!shadows_ || node.cluster_count < clusters_worth_a_test) return false;
    const auto hides = [&] {
      return shadows_->hide(box_of(node), node.cluster_count >= clusters_worth_a_ray) ? 1u : 0u;
    };
    if (answers_.answer(hides) == 0) return false;
    work_.clusters_hidden += node.cluster_count;
    return true;
  }

  void visit(std::uint32_t index) {
    const ReceiverNode& node = scene_.tree.nodes[index];
    if (node.right == 0) {
      item_ = node.first_item;
      const ReceiverItem& item = scene_.tree.items[item_];
      for (std::uint32_t c = item.first_cluster; c < item.first_cluster + item.cluster_count; ++c) receive(c);
      return;
    }
    for (const std::uint32_t child : {index + 1, node.right})
      if (!skipped(scene_.tree.nodes[child])) visit(child);
  }

  void receive(std::uint32_t index) {
    const Cluster& cluster = scene_.tree.clusters[index];
    if (view_.behind(cluster.lo, cluster.hi) || (cluster.planar && faces_away(cluster))) {
      ++work_.clusters_behind;
      return;
    }
    ++work_.clusters_tested;
    if (view_.items) return receive_by_items(cluster, index);
    shadows_->enter_cluster(box_of(cluster));
    outlined_ = 0;
    // The level of detail follows from the distance alone. It must never change from shot to shot: what a receiver got of single
    // elements earlier would not fit what it gets of their mean later.
    const auto all = static_cast<std::uint32_t>(shot_.parts.size());
    std::uint32_t reflected_up_to = shot_.reflects ? 0 : all, emitted_up_to = shot_.emits ? 0 : all;  // is settled
    for (std::uint32_t p = 0; p < all;) {
      const ShotPart& part = shot_.parts[p];
      if (part.level != ShotPart::Level::element) shadows_->enter_part(p == 0 ? nullptr : &part.source.box);
      const bool is_enough = suffices(part, cluster);
      const bool reflects = p >= reflected_up_to && is_enough && !part.is_mixed;
      const bool emits = p >= emitted_up_to && is_enough && part.level >= view_.emission;
      if (reflects) reflected_up_to = part.end;
      if (emits) emitted_up_to = part.end;
      if (reflects || emits) add(cluster, index, part, share(reflects, emits));
      p = reflected_up_to >= part.end && emitted_up_to >= part.end ? part.end : p + 1;
    }
  }

  /// Whether the receivers are far enough to see the part as one.
  bool suffices(const ShotPart& part, const Cluster& cluster) const {
    if (part.level == ShotPart::Level::element) return true;
    const TransferOptions& options = scene_.options;
    const double radii = part.level == ShotPart::Level::patch ? 1 + options.near_factor : options.group_factor;
    return distance_to_box(part.source.flat, cluster.lo, cluster.hi) > static_cast<float>(radii) * part.source.radius;
  }

  /// Of the light that is forecast for a receiver: what a source could bring it if nothing stood between (1).
  float share_of_light(const FlatSource& source, float distance, float light) const {
    const float area = 2 * source.radius * source.radius;  // of a square
    return view_.radiosity * area / (std::numbers::pi_v<float> * distance * distance * std::max(light, 1e-30f));
  }

  /// The paper's transfer: patch by patch, each receiver seen or not from the centre of the shooting patch.
  void receive_by_items(const Cluster& cluster, std::uint32_t index) {
    item_patch_ = 0;
    for (const ShotPart& part : shot_.parts) {
      if (part.level != ShotPart::Level::patch) continue;
      add(cluster, index, part, share(shot_.reflects, shot_.emits));
      ++item_patch_;
    }
  }

  void look_up_items(const Cluster& cluster, std::uint32_t seen) {
    const Receivers16& r = cluster.points;
    for (int lane = 0; lane < 16; ++lane) {
      if (!((seen >> lane) & 1)) continue;
      const PatchPlace& place = scene_.tree.patches[cluster.first_patch + cluster.patch[lane]];
      const Vec3 point = Vec3{r.x[lane], r.y[lane], r.z[lane]} + scene_.origin;
      if (!view_.items->sees(item_patch_, point, scene_.mesh.patches[place.mesh_patch].plane.value))
        factors_.segments.tfar[lane] = -1.f;
    }
  }

  bool faces_away(const Cluster& cluster) const {
    const Receivers16& r = cluster.points;
    const FlatShooter& f = shot_.group().flat;
    const float height = (f.cx - r.x[0]) * r.nx[0] + (f.cy - r.y[0]) * r.ny[0] + (f.cz - r.z[0]) * r.nz[0];
    return height + shot_.group().radius <= 0;
  }

  /// What of a source's light.
  enum class Share { reflected, emitted, both };
  static Share share(bool reflects, bool emits) {
    return !emits ? Share::reflected : reflects ? Share::both : Share::emitted;
  }

  /// Transfer from one polygon into one cluster.
  void add(const Cluster& cluster, std::uint32_t index, const ShotPart& part, Share share) {
    const FlatSource& source = part.source;
    if (!view_.items) {
      near_ = near_of(cluster, source);
      if (near_ != 0) add_near(cluster, index, part, share);
      if (near_ == cluster.lanes) return;
    }
    const std::uint32_t sees = answers_.answer([&] { return cast(cluster, source); });
    if (sees == 0) return;
    if (answers_.are_read()) {
      asked_ = form_factors(cluster, source);
      for (int lane = 0; lane < 16; ++lane)
        if ((sees >> lane & 1) == 0) factors_.segments.tfar[lane] = -1.f;
      const auto lanes = static_cast<std::uint64_t>(__builtin_popcount(sees));
      work_.rays += lanes, work_.rays_saved += lanes, work_.rays_remembered += lanes;
    }
    settle({index, item_, &part, share, sees});
  }

  /// Lanes that see the part as outlines.
  std::uint32_t near_of(const Cluster& cluster, const FlatSource& source) {
    const std::uint32_t facing = near_lanes(cluster, source, turned_to_source);
    if (!view_.is_luminaire) return facing;
    std::uint32_t near = facing;
    for (std::uint32_t left = near_lanes(cluster, source, turned_to_luminaire) & ~facing; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(left);
      near |= (is_at_gap(outline(cluster, lane).outline, source.flat) ? 1u : 0u) << lane;
    }
    return near;
  }

  /// Transfer into the receivers of a cluster that are near: what points all over the source see of each.
  void add_near(const Cluster& cluster, std::uint32_t index, const ShotPart& part, Share share) {
    float factor[16] = {};
    if (!answers_.are_read()) find_near_factors(cluster, part.source, factor);
    // They are noted, like shadows, and used as they are noted. In steps of their roots, the sum of all keeps five digits.
    constexpr float steps = 65535.f;
    for (std::uint32_t left = near_; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(left);
      const float root =
          static_cast<float>(answers_.answer([&] {
            return static_cast<std::uint32_t>(std::lround(steps * std::sqrt(std::min(factor[lane], 1.f))));
          })) /
          steps;
      factor[lane] = root * root;
      if (answers_.are_read()) ++work_.rays, ++work_.rays_saved, ++work_.rays_remembered;
    }
    std::uint32_t sees = 0;
    for (int lane = 0; lane < 16; ++lane) {
      factors_.factor[lane] = factor[lane];
      factors_.segments.tfar[lane] = 1.f;
      sees |= (factor[lane] > 0.f ? 1u : 0u) << lane;
    }
    if (sees != 0 && view_.incoming) sees = apply_bitmap(cluster, sees);
    asked_ = sees;
    if (sees != 0) settle({index, item_, &part, share, sees});
  }

  /// Of the near lanes: what points all over the source see of each.
  void find_near_factors(const Cluster& cluster, const FlatSource& source, float (&factor)[16]) {
    const NearPoints points(source, gap_between(cluster, near_, source));
    for (std::uint32_t k = 0; k < points.packet_count(); ++k) {
      const Receivers16 places = points.packet(k);
      for (std::uint32_t left = near_; left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        factor[lane] += sum_seen(places, outline(cluster, lane)) * points.share(cluster.area[lane]);
      }
    }
  }

  /// Σ F(s -> R) over those of 16 points that see the receiver. These rays are not looked up: hulls hold no outlines of receivers.
  float sum_seen(const Receivers16& points, const NearReceiver& receiver) {
    work_.form_factors += 16;
    const std::uint32_t asked =
        kernels_.factor16(points, 0xffff, receiver.outline, receiver.aim, 0, view_.offset, factors_);
    if (asked == 0) return 0.f;
    work_.rays += static_cast<std::uint64_t>(__builtin_popcount(asked));
    scene_.rays.occluded16(factors_.segments, factors_.seen);
    float sum = 0;
    for (int s = 0; s < 16; ++s)
      if ((asked >> s & 1) != 0 && factors_.segments.tfar[s] >= 0.f) sum += factors_.factor[s];
    return sum;
  }

  /// Of a lane of the cluster under way.
  const NearReceiver& outline(const Cluster& cluster, int lane) {
    if ((outlined_ >> lane & 1) == 0) {
      outlined_ |= 1u << lane;
      outlines_.resize(16);
      const PatchPlace& place = scene_.tree.patches[cluster.first_patch + cluster.patch[lane]];
      outlines_[static_cast<std::size_t>(lane)] =
          near_receiver(scene_.mesh, cluster.element[lane], place.mesh_patch, scene_.origin);
    }
    return outlines_[static_cast<std::size_t>(lane)];
  }

  /// A number that mostly differs between neighbours; where clusters are of one group, and not of several small ones, it is the same
  /// however the scene is cut into cells.
  static std::uint32_t number_of(const Cluster& cluster) { return cluster.element[0] / 16; }
  /// Which of 16 places the first lane aims at.
  static int turn_of(const Cluster& cluster) {
    const std::uint32_t number = number_of(cluster);
    return static_cast<int>((number * 7 + number / 16) & 15);
  }

  /// @returns lanes that the shooter's front is turned to
  std::uint32_t form_factors(const Cluster& cluster, const FlatSource& source) {
    work_.form_factors += 16;
    const std::uint32_t seen =
        kernels_.factor16(cluster.points, cluster.lanes & ~near_, source.flat,
                          shot_.aims_of(source, number_of(cluster)).place, turn_of(cluster), view_.offset, factors_);
    if (!view_.items && distance_to_box(source.flat, cluster.lo, cluster.hi) > widths_to_spread * cluster.width)
      spread(cluster, source);
    return seen;
  }

  /// Moves the beginnings of shadow rays over their elements, another way for each source: rays from middles alone fall into step with the
  /// edges of doors and slits, and of the light behind those comes some percent too much or too little.
  void spread(const Cluster& cluster, const FlatSource& source) {
    constexpr std::uint32_t places = 63;  // and one more
    const std::uint32_t number = number_of(cluster) * 977 + source.first_aims * 31 + view_.group * 7919;
    const Vec2 spot = r2_point(number & places, Vec2{0.0}) - 0.5;
    const float s = static_cast<float>(spot.x), t = static_cast<float>(spot.y);
    Segments16& g = factors_.segments;
    for (int lane = 0; lane < 16; ++lane) {
      const float x = s * cluster.across[0][lane] + t * cluster.along[0][lane];
      const float y = s * cluster.across[1][lane] + t * cluster.along[1][lane];
      const float z = s * cluster.across[2][lane] + t * cluster.along[2][lane];
      g.ox[lane] += x, g.oy[lane] += y, g.oz[lane] += z;
      g.dx[lane] -= x, g.dy[lane] -= y, g.dz[lane] -= z;
    }
  }

  /// Finds who sees the polygon. @returns those lanes
  std::uint32_t cast(const Cluster& cluster, const FlatSource& source) {
    std::uint32_t seen = form_factors(cluster, source);
    if (seen != 0 && view_.incoming) seen = apply_bitmap(cluster, seen);
    asked_ = seen;
    if (seen == 0) return 0;
    if (view_.items)
      look_up_items(cluster, seen);
    else
      shadows_->cast(factors_, seen);
    std::uint32_t blocked = 0;
    for (int lane = 0; lane < 16; ++lane) blocked |= (factors_.segments.tfar[lane] < 0.f ? 1u : 0u) << lane;
    return seen & ~blocked;
  }

  /// Who gets what from whom.
  struct Arrival {
    std::uint32_t cluster = 0, item = 0;
    const ShotPart* part = nullptr;
    Share share = Share::reflected;
    std::uint32_t sees = 0;  ///< lanes
  };

  /// Adds what is not blocked.
  void settle(const Arrival& arrival) {
    const Cluster& cluster = scene_.tree.clusters[arrival.cluster];
    ClusterLight& light = light_.clusters[arrival.cluster];
    const Sent sent = arrival.sees == asked_ || arrival.part->level == ShotPart::Level::element || view_.items
                          ? sent_by(arrival.part->source)
                          : seen_of(arrival);
    float delta[3];
    for (int c = 0; c < 3; ++c)
      delta[c] = (arrival.share == Share::emitted ? 0.f : sent.reflected[c]) +
                 (arrival.share == Share::reflected ? 0.f : sent.emitted[c]);
    const float received_area = kernels_.accumulate16(factors_, cluster.area, delta, light.received);
    if (received_area <= 0.f) return;
    if (arrival.share != Share::reflected) kernels_.accumulate16(factors_, nullptr, sent.emitted, light.direct);
    credit(cluster, Rgb{delta[0], delta[1], delta[2]}, received_area);
    if (touched_items_.empty() || touched_items_.back() != arrival.item) touched_items_.push_back(arrival.item);
  }

  /// Unshot radiosity (W/m²).
  struct Sent {
    float reflected[3] = {}, emitted[3] = {};
  };
  static Sent sent_by(const FlatSource& source) {
    Sent sent;
    std::copy_n(source.reflected, 3, sent.reflected), std::copy_n(source.emitted, 3, sent.emitted);
    return sent;
  }

  /// What a source that is hidden in part sends to the lanes that see it, for each of their form factors. Not its mean: what is
  /// hidden under furniture is dark, of a slat one sees the bright side or the other; and near parts are rarely hidden, and
  /// send more than far ones. So each lane stands for the place it aims at, and weighs as much as its like would send it:
  ///
  ///     B = Σ_seen w_i k_i A_i B_i / Σ w_i k_i A_i · Σ F_i A_i / Σ_seen F_i A_i,    k = cosθ cosθ' / r²
  Sent seen_of(const Arrival& arrival) const {
    const Cluster& cluster = scene_.tree.clusters[arrival.cluster];
    const FlatSource& source = arrival.part->source;
    const Aims& aims = shot_.aims_of(source, number_of(cluster));
    const int turn = turn_of(cluster);
    float all = 0, all_seen = 0, weights = 0, weights_seen = 0;
    float reflected[3] = {};
    for (std::uint32_t left = asked_; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(left), place = lane + turn;
      const float area = factors_.factor[lane] * cluster.area[lane];
      // Behind a receiver's horizon there is nothing to aim at: the kernel chose another place, which stands for the whole.
      const bool is_mean = is_behind(cluster.points, lane, aims.place, place);
      // Bitmaps weaken factors by what is hidden of the whole source.
      const float weight = (is_mean ? 1.f : aims.weight[place]) * exchange(cluster, source.flat, lane) *
                           cluster.area[lane] * visible_[lane];
      all += area, weights += weight;
      if ((arrival.sees >> lane & 1) == 0) continue;
      all_seen += area, weights_seen += weight;
      for (int c = 0; c < 3; ++c) reflected[c] += weight * (is_mean ? source.reflected[c] : aims.reflected[c][place]);
    }
    Sent sent;
    if (!(weights > 0) || !(all_seen > 0)) return sent;
    // Lanes whose factors are less than this share of all have nothing to tell, and what is divided by them may be beyond all numbers.
    constexpr float least_seen = 1e-6f;
    const float scale = all / std::max(all_seen, least_seen * all);
    for (int c = 0; c < 3; ++c) {
      sent.reflected[c] = reflected[c] / weights * scale;
      sent.emitted[c] = source.emitted[c] * (weights_seen / weights) * scale;
    }
    return sent;
  }

  static bool is_behind(const Receivers16& r, int lane, const Aim16& aim, int place) {
    return (aim.x[place] - r.x[lane]) * r.nx[lane] + (aim.y[place] - r.y[lane]) * r.ny[lane] +
               (aim.z[place] - r.z[lane]) * r.nz[lane] <=
           0;
  }

  /// cosθ cosθ' / r² of a lane and the place it aims at (1/m²).
  float exchange(const Cluster& cluster, const FlatShooter& f, int lane) const {
    const Segments16& s = factors_.segments;
    const Receivers16& r = cluster.points;
    const float x = s.dx[lane], y = s.dy[lane], z = s.dz[lane], square = x * x + y * y + z * z;
    const float height = x * r.nx[lane] + y * r.ny[lane] + z * r.nz[lane];
    const float height_there = -(x * f.nx + y * f.ny + z * f.nz);
    return height > 0 && height_there > 0 ? height / square * (height_there / square) : 0.f;
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

  /// Weakens factors by what is covered in nearer cells. @returns the lanes that are left
  std::uint32_t apply_bitmap(const Cluster& cluster, std::uint32_t seen) {
    alignas(64) float x[16], y[16], z[16];
    const Receivers16& r = cluster.points;
    for (int lane = 0; lane < 16; ++lane) {
      const float dx = r.x[lane] - view_.centre[0], dy = r.y[lane] - view_.centre[1], dz = r.z[lane] - view_.centre[2];
      x[lane] = dx * view_.tangent[0] + dy * view_.tangent[1] + dz * view_.tangent[2];
      y[lane] = dx * view_.bitangent[0] + dy * view_.bitangent[1] + dz * view_.bitangent[2];
      z[lane] = dx * view_.normal[0] + dy * view_.normal[1] + dz * view_.normal[2];
    }
    view_.incoming->visibility16(x, y, z, visible_);
    std::uint32_t left = 0;
    for (int lane = 0; lane < 16; ++lane) {
      factors_.factor[lane] *= visible_[lane];
      left |= (factors_.factor[lane] > 0.f ? 1u : 0u) << lane;
    }
    left &= seen;
    for (int lane = 0; lane < 16; ++lane) factors_.seen.lane[lane] = left >> lane & 1 ? -1 : 0;
    return left;
  }

  const ShotView& view_;
  const LocalShot& shot_;
  const TransferScene& scene_;
  Radiosity& light_;
  const Kernels& kernels_ = kernels();
  std::optional<Shadows> shadows_;
  std::size_t item_patch_ = 0;
  IslandAnswers answers_;
  Factors16 factors_;
  alignas(64) float visible_[16];       ///< what nearer cells leave of the source (1)
  std::uint32_t asked_ = 0;             ///< lanes of factors_ whose shadow rays are asked
  std::uint32_t near_ = 0;              ///< lanes that see the part as outlines
  std::uint32_t outlined_ = 0;          ///< lanes of the cluster under way whose outlines are known
  std::vector<NearReceiver> outlines_;  ///< 16, as soon as one is asked for
  TransferWork work_;
  std::uint32_t item_ = 0;                    ///< the one under way
  std::vector<std::uint32_t> touched_items_;  ///< items that something arrived at
  static constexpr std::uint32_t clusters_worth_a_test = 3, clusters_worth_a_ray = 8;
  static constexpr float least_share = 1e-4f;
  static constexpr float widths_to_spread = 4;  // of an element: nearer, factors vary over it as shadows do
};

}  // namespace

float reach_of(double area, const TransferOptions& options) {
  return static_cast<float>(std::sqrt(area / (std::numbers::pi * options.contribution_cut)));
}

TransferWork transfer(const Shot& shot, const HemicubeBitmap* incoming, const TransferScene& scene, Radiosity& light,
                      const Parallel& parallel) {
  const ShotView view(shot, incoming, scene, parallel);
  const std::vector<std::uint32_t>& islands = scene.tree.islands;
  const VisibilityCache::Key key{shot.group, view.local.reflects, view.local.emits};
  const VisibilityAnswers* known = scene.answers ? scene.answers->find(key) : nullptr;
  const bool noted = scene.answers && !known && scene.answers->has_room();
  std::vector<std::vector<std::uint16_t>> notes(noted ? islands.size() : 0);
  std::vector<TransferWork> parts(islands.size());
  parallel.for_each(islands.size(), [&](std::size_t i) {
    IslandAnswers answers;
    if (known)
      answers.read(known->of_island(i));
    else if (noted)
      answers.note_in(notes[i]);
    parts[i] = IslandTask(view, scene, light, answers).run(islands[i]);
  });
  if (noted) scene.answers->keep(key, VisibilityAnswers(notes));
  // Summed in the order of the islands, so that the total does not depend on the threads.
  TransferWork total;
  for (const TransferWork& part : parts) {
    total.rays += part.rays;
    total.rays_saved += part.rays_saved;
    total.rays_remembered += part.rays_remembered;
    total.form_factors += part.form_factors;
    total.clusters_tested += part.clusters_tested;
    total.clusters_behind += part.clusters_behind;
    total.clusters_hidden += part.clusters_hidden;
    total.clusters_cut += part.clusters_cut;
    total.received += part.received;
  }
  return total;
}

}  // namespace lichthof
