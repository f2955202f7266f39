/// Receivers that are large beside their distance from a source: a lamp a hand below the ceiling, a cabinet before a wall.
///
/// The point in the middle of a receiver stands for it only from some of its own widths on: nearer, a small source lights a spot
/// between the points, or one of them stands in it for all of its element, and of what was sent any multiple arrives. So a
/// near receiver that faces the source is seen as the polygon it is, from points all over the source:
///
///     A_R F_RS = A_S F_SR = A_S / N Σ_s F(s → R)
///
/// Each point s gives all that faces it just 1 together, so that what arrives is what was sent however thin the gap; only which
/// neighbour gets it is sampled. Receivers at right angles stay points: along the edges of rooms those err little, and keep what
/// each receives of all sources together exact.
#pragma once

#include <array>

#include "core/light/local_shot.hpp"
#include "core/light/receiver_tree.hpp"

namespace lichthof {

/// Bit i: lane i is turned to the source and too large for its distance to be a point. Follows from geometry alone.
/// @param turned  cos of the angle between the normals, at most
/// @cost a few ns where no lane is near
std::uint32_t near_lanes_of(const Cluster& cluster, const FlatSource& source, float turned);
inline std::uint32_t near_lanes(const Cluster& cluster, const FlatSource& source, float turned) {
  const Receivers16& r = cluster.points;
  const FlatShooter& f = source.flat;
  if (cluster.planar && r.nx[0] * f.nx + r.ny[0] * f.ny + r.nz[0] * f.nz > turned) return 0;
  return near_lanes_of(cluster, source, turned);
}

/// What near_lanes() asks of all sources, and of luminaires: slats and shades that stand at right angles on a lamp get much of its light.
constexpr float turned_to_source = -0.26f, turned_to_luminaire = 0.26f;

/// Points all over a source, 16 at a time, equally dense by area; they look where it shoots.
class NearPoints {
 public:
  static constexpr std::uint32_t most_packets = 16;
  /// @param gap  m; nearer than an eighth of the source's width 256 points are taken instead of 16: less than so many are seen by the
  ///             smaller of its receivers
  NearPoints(const FlatSource& source, float gap);
  std::uint32_t packet_count() const { return packet_count_; }
  Receivers16 packet(std::uint32_t index) const;
  float area() const { return area_; }  ///< A_S (m²)
  /// What a point's factor of a receiver counts in that receiver's factor of the source: A_S / (N A_R).
  float share(float receiver_area) const { return area_ / (16.f * static_cast<float>(packet_count_) * receiver_area); }

 private:
  const FlatShooter& flat_;
  std::uint32_t packet_count_ = 1;
  float area_ = 0;
};

/// An element as a source sees it: its outline, and places of it for shadow rays.
struct NearReceiver {
  FlatShooter outline;
  Aim16 aim;
};
/// Whether a receiver at right angles, or nearly so, begins close over the source's plane, or crosses it. What stands on that plane, as
/// walls do on a luminous ceiling, leaves no gap: points do there, and in the rows beyond.
bool is_at_gap(const FlatShooter& receiver, const FlatShooter& source);
NearReceiver near_receiver(const Mesh& mesh, std::uint32_t element, std::uint32_t patch, const Vec3& origin);

/// m; height of the lowest of these receivers over the source's plane, 0 where one lies below.
float gap_between(const Cluster& cluster, std::uint32_t lanes, const FlatSource& source);

/// 16 places all over a polygon, no two in a row of 16 equal strips along either of two sides; turned by the lane they start with.
Aim16 places_over(const FlatShooter& polygon);

}  // namespace lichthof
