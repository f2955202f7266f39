/// Rays against the input surfaces: the only door to Embree. Rays never meet the mesh, only the scene's own polygons.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// 16 segments at a time, in the ray scene's local frame; structure of arrays as the kernel wants it.
/// Lane i runs from origin + 0 to origin + direction (t in [0, 1]).
struct alignas(64) Segments16 {
  float ox[16], oy[16], oz[16], tnear[16];
  float dx[16], dy[16], dz[16], time[16];
  float tfar[16];
  std::uint32_t mask[16], id[16], flags[16];
};

/// Lanes to trace: -1 where active, 0 elsewhere, as the kernel wants it.
struct alignas(64) LaneMask16 {
  std::int32_t lane[16];
};

struct Hit {
  std::uint32_t surface = 0;  ///< index into the span the ray scene was built from
  double distance = 0;        ///< in lengths of the given direction
  bool front = true;          ///< the ray met the front side
};

/// What a ray may pass: light passes clear glass on its way (a straight-line approximation of thin panes).
enum class Glass : std::uint8_t { opaque, clear };

/// An immutable set of polygons, ready for rays. Coordinates are kept relative to `origin` in single precision.
///
/// Ends of segments that lie on surfaces must be moved along the normal by offset(): 1e-6 of the largest local
/// coordinate, at least 3 times the rounding of the kernel; thinner sheets than that leak (numerics: section 6).
class RayScene {
 public:
  /// @param surfaces  convex planar polygons; copied
  /// @param origin    world point that becomes the local zero (m)
  /// @param glass     `clear`: surfaces of finish glass are left out
  RayScene(const Scene& scene, std::span<const Surface> surfaces, const Vec3& origin, Glass glass = Glass::opaque);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  const Vec3& origin() const;
  /// Distance by which both ends of a segment are lifted off their surfaces (m).
  double offset() const;
  std::size_t surface_count() const;
  /// What Embree allocated for the hierarchy, and what is kept beside it (bytes). Scenes that are built at the same time share
  /// what they took together in some way.
  std::size_t memory_bytes() const;

  /// Marks lanes of `active` whose segment meets a surface. @returns bit i set = lane i is blocked.
  /// `segments.tnear` .. must be initialised once by clear_segments(); tfar is overwritten.
  std::uint32_t occluded16(Segments16& segments, std::uint32_t active) const;
  /// The same for the inner loop: tfar must be 1 in active lanes, and is negative in blocked ones afterwards.
  void occluded16(Segments16& segments, const LaneMask16& active) const;

  /// True when something lies between the two world points. The points are taken as they are: offset them first.
  bool occluded(const Vec3& from, const Vec3& to) const;

  /// Nearest surface along a world ray, or none. `direction` need not be unit.
  std::optional<Hit> nearest(const Vec3& from, const Vec3& direction, double max_distance = 1e30) const;

  /// 16 rays from local origins along local directions; hit surface per lane, or no_surface.
  static constexpr std::uint32_t no_surface = 0xffffffffu;
  struct Hits16 {
    std::uint32_t surface[16];
    float distance[16];
    std::uint32_t front_bits;
  };
  void nearest16(const Segments16& rays, std::uint32_t active, Hits16& hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The boxes of a scene's surfaces, to find those near a place however many there are elsewhere.
class SurfaceBoxes {
 public:
  /// @param scene  must outlive this
  explicit SurfaceBoxes(const Scene& scene);
  ~SurfaceBoxes();
  /// Numbers of the surfaces whose bounding box meets `box`, ascending. @cost about 1 µs, and more for long boxes
  std::vector<std::uint32_t> near(const Box& box) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Fills the lanes' constant fields (tnear 0, mask all ones ...).
void clear_segments(Segments16& segments);

}  // namespace lichthof
