/// Shadows inside a cell: which lanes of a packet see the shooter. Most packets are answered by what is known of the surfaces
/// around them; rays are traced for the others.
///
/// From the cheapest answer on: a convex surface hides the whole box of many receivers; no surface reaches into the hull of
/// shooter and receivers (shaft culling [Haines94]); what blocked the neighbours blocks this packet; the few surfaces in the
/// packet's own hull are looked at one by one; rays. All of them are exact: rays alone would give the same lanes. Hulls are not
/// searched where most of them are crowded (core/light/cell_light).
#pragma once

#include <cstdint>

#include "core/light/kernels/kernels.hpp"
#include "core/light/occluders.hpp"
#include "core/light/raycast.hpp"

namespace lichthof {

/// The shooter of a shot, as its shadows need it; the same for all tasks.
struct ShadowShooter {
  ShadowShooter(const FlatShooter& polygon, const Occluders& occluders, bool in_hulls);
  FlatShooter polygon;
  FlatBox box;
  std::vector<ShooterSides> sides;  ///< by block of `occluders`; empty where no hulls are searched
};

/// Sees every packet before it is answered: for measurements.
class PacketObserver {
 public:
  virtual ~PacketObserver() = default;
  virtual void see(const Segments16& packet, std::uint32_t lanes) = 0;
};

/// Of one shot on one thread, for islands of neighbouring clusters one after the other.
class Shadows {
 public:
  /// Looking at this many occluders takes about as long as tracing a packet.
  static constexpr int few_occluders = 16;

  /// @param in_hulls  whether the hulls of shooter and receivers are searched for occluders; the answers are the same without
  Shadows(const ShadowShooter& shooter, const Occluders& occluders, const RayScene& rays, bool in_hulls,
          PacketObserver* observer);

  /// True when one convex surface hides the whole box from the whole shooter.
  /// @param look  whether a ray to the middle of the box may find it, or only what hid something before
  bool hide(const FlatBox& box, bool look);
  /// From now on receivers lie in this box ...
  void enter_island(const FlatBox& box);
  /// ... and in this one.
  void enter_cluster(const FlatBox& box);
  /// From now on packets go to the part of the shooter in this box, which the caller keeps; nullptr: to all of it.
  void enter_part(const FlatBox* box);
  /// Gives blocked lanes a negative tfar. @param seen  lanes in use; they lie in the cluster's box
  void cast(Factors16& packet, std::uint32_t seen);

  /// Shadow rays answered: lanes cast, and rays that looked for an occluder.
  std::uint64_t rays() const { return rays_; }
  /// Those answered without the ray tracer.
  std::uint64_t rays_saved() const { return rays_saved_; }

 private:
  bool known_block(Factors16& packet);
  bool look_one_by_one(Factors16& packet);
  void find_in_part();
  void trace(Factors16& packet, std::uint32_t seen);
  void remember(std::uint32_t occluder);

  const ShadowShooter& shooter_;
  const Occluders& occluders_;
  const RayScene& ray_scene_;
  bool in_hulls_;
  PacketObserver* observer_;
  const Kernels& kernels_ = kernels();
  float offset_;
  std::uint64_t rays_ = 0, rays_saved_ = 0;

  OccluderSelection island_;  ///< what reaches into the hull of shooter and island
  // What reaches into the hulls of the cluster and all of the shooter, of the cluster and the part; found when needed.
  FlatBox cluster_;
  const FlatBox* part_ = nullptr;
  std::vector<Candidates> in_cluster_, in_part_;
  std::size_t cluster_count_ = 0, part_count_ = 0;
  bool cluster_is_known_ = false, part_is_known_ = false;
  bool one_by_one_ = false;  ///< few enough in the part

  static constexpr int most_known = 4;
  std::uint32_t known_[most_known] = {};  ///< what blocked something lately, the most useful first
  int known_count_ = 0;
};

}  // namespace lichthof
