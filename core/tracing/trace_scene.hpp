/// A scene made ready for rays that scatter: what a ray meets, which glass is a pane and which a solid, how much light
/// clear glass lets through. Shared, immutable, safe for any number of threads.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/light/raycast.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// A point on one side of a surface.
struct SurfacePoint {
  std::uint32_t surface = 0;  ///< index into Scene::surfaces
  bool back = false;          ///< on the back of it
  Vec3 point;                 ///< on the surface's plane (m)
  Vec3 normal;                ///< unit, out of this side
};

/// How a ray goes on from a face of glass.
struct GlassWay {
  Vec3 from, direction;
  bool is_reflected = false;
};

class TraceScene {
 public:
  /// @pre at least one surface
  explicit TraceScene(std::shared_ptr<const Scene> scene);

  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
  /// Rays that stop at glass.
  const RayScene& rays() const { return rays_; }
  /// Rays that glass does not stop.
  const RayScene& clear_rays() const { return clear_ ? *clear_ : rays_; }
  bool has_glass() const { return clear_ != nullptr; }
  bool has_solids() const { return has_solids_; }  ///< some glass bends rays: see is_solid_glass()
  double size() const { return size_; }  ///< diagonal of the bounding box (m)

  /// Distance by which ends of rays are lifted off surfaces (m).
  double offset() const { return rays_.offset(); }
  Vec3 lifted(const SurfacePoint& at) const { return at.point + offset() * at.normal; }

  /// What a ray meets first; the point is put back onto the surface's plane. `direction` need not be unit.
  std::optional<SurfacePoint> nearest(const Vec3& from, const Vec3& direction) const;
  SurfacePoint surface_point(std::uint32_t surface, bool front, const Vec3& near_point) const;
  /// The surface side that a point with this normal lies on, if any. @param tolerance  m
  std::optional<SurfacePoint> surface_below(const Vec3& point, const Vec3& normal, double tolerance) const;

  /// True for glass that bounds a closed volume (every edge shared by two faces): there rays are refracted. All other
  /// glass is a pane: rays pass straight through its two faces.
  bool is_solid_glass(std::uint32_t surface) const { return has_glass() && solid_[surface] != 0; }

  /// One of both ways from a face of glass, drawn by its share: reflected, or through it, which solids bend.
  /// @param direction  unit, towards the face @param choice  in [0, 1) @returns nothing where a way through does not exist
  std::optional<GlassWay> way_at_glass(const SurfacePoint& at, const Vec3& direction, double choice) const;

  /// Radiance (W/(m² sr)) of the luminaire that a face of glass shows by reflection, weakened by its share; 0 where it shows none.
  /// Left to the draw of way_at_glass(), lamps in panes are rare and bright. @param rays  grows by one
  Rgb luminaire_in_glass(const SurfacePoint& at, const Vec3& direction, std::uint64_t& rays) const;

  /// Share of light that clear glass lets through between two points (1); the direction is not bent, solids count each of
  /// their faces. @param solids_block  true: solid glass counts as opaque @returns 1 without glass
  double transmittance(const Vec3& from, const Vec3& to, bool solids_block = false) const;
  std::size_t memory_bytes() const;

 private:
  void find_solids();
  double refractive_index(const SurfacePoint& at) const;  ///< of what lies behind the face, over that before it
  double glass_reflectance(const SurfacePoint& at, const Vec3& direction) const;

  std::shared_ptr<const Scene> scene_;
  double size_;
  RayScene rays_;
  std::unique_ptr<RayScene> clear_;  ///< without glass; null when there is none
  std::unique_ptr<RayScene> glass_only_;
  std::vector<std::uint32_t> glass_surfaces_;  ///< surface behind each index of glass_only_
  std::vector<std::uint8_t> solid_;
  bool has_solids_ = false;
};

}  // namespace lichthof
