#include "core/light/shadows.hpp"

#include <algorithm>
#include <optional>

namespace lichthof {

namespace {

/// With more of them around, most hulls are crowded and looking for the few that are not does not pay.
constexpr std::size_t most_in_island = 128;

}  // namespace

ShadowShooter::ShadowShooter(const FlatShooter& polygon_, const Occluders& occluders, bool in_hulls)
    : polygon(polygon_), box(box_of(polygon_)) {
  if (in_hulls) sides = occluders.sides_of(polygon_);
}

Shadows::Shadows(const ShadowShooter& shooter, const Occluders& occluders, const RayScene& rays, bool in_hulls,
                 PacketObserver* observer)
    : shooter_(shooter), occluders_(occluders), ray_scene_(rays), in_hulls_(in_hulls), observer_(observer),
      offset_(static_cast<float>(rays.offset())) {}

bool Shadows::hide(const FlatBox& box, bool look) {
  const FlatShooter& f = shooter_.polygon;
  alignas(32) float corner[3][8];
  const float margin = 2 * offset_;
  for (int k = 0; k < 8; ++k)
    for (int axis = 0; axis < 3; ++axis)
      corner[axis][k] = (k >> axis) & 1 ? box.hi[axis] + margin : box.lo[axis] - margin;
  for (int k = 0; k < known_count_; ++k)
    if (kernels_.hidden8(corner, f, occluders_[known_[k]], margin)) return true;
  if (!look) return false;
  const Vec3 from = Vec3{f.cx, f.cy, f.cz} + 2.0 * offset_ * Vec3{f.nx, f.ny, f.nz} + ray_scene_.origin();
  const Vec3 to = 0.5 * Vec3{box.lo[0] + box.hi[0], box.lo[1] + box.hi[1], box.lo[2] + box.hi[2]} + ray_scene_.origin();
  const std::optional<Hit> hit = ray_scene_.nearest(from, to - from, 0.9999);
  ++rays_;
  if (!hit) return false;
  remember(hit->surface);
  return kernels_.hidden8(corner, f, occluders_[hit->surface], margin);
}

void Shadows::enter_island(const FlatBox& box) {
  island_.complete = false;
  if (!in_hulls_) return;
  island_ = occluders_.in_shaft(shaft_between(shooter_.box, box, offset_), shooter_.sides, most_in_island);
  in_cluster_.resize(island_.candidates.size());
  in_part_.resize(island_.candidates.size());
}

void Shadows::enter_cluster(const FlatBox& box) {
  cluster_ = box;
  cluster_is_known_ = false;
}

void Shadows::enter_part(const FlatBox* box) {
  part_ = box;
  part_is_known_ = false;
}

void Shadows::cast(Factors16& packet, std::uint32_t seen) {
  if (observer_) observer_->see(packet.segments, seen);
  const auto lanes = static_cast<std::uint64_t>(__builtin_popcount(seen));
  rays_ += lanes;
  if ((island_.complete && island_.candidates.empty()) || known_block(packet) || look_one_by_one(packet)) {
    rays_saved_ += lanes;
    return;
  }
  trace(packet, seen);
}

/// What stood in the way of the neighbours: where most is hidden, few packets need more. @returns whether no lane is left
bool Shadows::known_block(Factors16& packet) {
  for (int k = 0; k < known_count_; ++k)
    if (!kernels_.block16(occluders_[known_[k]], packet.segments, packet.seen)) {
      std::swap(known_[k], known_[k / 2]);
      return true;
    }
  return false;
}

/// @returns false when rays are better
bool Shadows::look_one_by_one(Factors16& packet) {
  if (!island_.complete) return false;
  if (!part_is_known_) find_in_part();
  if (!one_by_one_) return false;
  for (std::size_t k = 0; k < part_count_; ++k)
    for (std::uint32_t left = in_part_[k].lanes; left != 0; left &= left - 1) {
      const std::uint32_t occluder = island_.blocks[in_part_[k].block].index[__builtin_ctz(left)];
      if (kernels_.block16(occluders_[occluder], packet.segments, packet.seen)) continue;
      remember(occluder);
      return true;
    }
  return true;
}

void Shadows::find_in_part() {
  part_is_known_ = true;
  const auto narrowed = [&](const FlatBox& shooter, const std::vector<Candidates>& from, std::size_t count,
                            std::vector<Candidates>& to) {
    if (count == 0) return count;
    return kernels_.in_shaft(shaft_between(shooter, cluster_, offset_), island_.blocks.data(), island_.sides.data(),
                             from.data(), count, to.data());
  };
  if (!cluster_is_known_)
    cluster_count_ = narrowed(shooter_.box, island_.candidates, island_.candidates.size(), in_cluster_);
  cluster_is_known_ = true;
  part_count_ = part_ ? narrowed(*part_, in_cluster_, cluster_count_, in_part_) : cluster_count_;
  if (!part_) std::copy_n(in_cluster_.begin(), cluster_count_, in_part_.begin());
  int occluders = 0;
  for (std::size_t k = 0; k < part_count_; ++k) occluders += __builtin_popcount(in_part_[k].lanes);
  one_by_one_ = occluders <= few_occluders;
}

void Shadows::trace(Factors16& packet, std::uint32_t seen) {
  ray_scene_.occluded16(packet.segments, packet.seen);
  const Segments16& s = packet.segments;
  for (int lane = 0; lane < 16; ++lane)
    if ((seen >> lane & 1) && s.tfar[lane] >= 0.f) return;
  // Everything is blocked: learn by what.
  const int lane = __builtin_ctz(seen);
  const std::optional<Hit> hit = ray_scene_.nearest(Vec3{s.ox[lane], s.oy[lane], s.oz[lane]} + ray_scene_.origin(),
                                                    Vec3{s.dx[lane], s.dy[lane], s.dz[lane]}, 1.0);
  ++rays_;
  if (hit) remember(hit->surface);
}

/// The newest known occluder replaces the one that helped least recently.
void Shadows::remember(std::uint32_t occluder) {
  for (int k = 0; k < known_count_; ++k)
    if (known_[k] == occluder) return;
  if (known_count_ < most_known) ++known_count_;
  for (int k = known_count_ - 1; k > 0; --k) known_[k] = known_[k - 1];
  known_[0] = occluder;
}

}  // namespace lichthof
