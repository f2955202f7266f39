/// Indirect irradiance by looking around: rays over the hemisphere, each of which reads the reflected radiosity where it
/// lands. Sharper than the mesh, because the mesh is only seen from afar.
///
///     E_indirect(p, n) = 1/G Σ ρ H(hit)          G rays, cosine-distributed
///
/// A hit nearer than an element sees the mesh too closely: there the ray is not answered by the element but goes on, with
/// direct light sampled on the spot, until it comes from far enough. This is what makes narrow gaps and corners right.
///
/// Emission is left out, since direct light is sampled on its own, except where it comes by way of a mirror, a glossy
/// lobe or a reflection off glass: no shadow ray finds that.
#pragma once

#include <cstdint>
#include <vector>

#include "core/tracing/lit_scene.hpp"

namespace lichthof {

class FinalGather {
 public:
  /// @param rays  G, rounded up to a multiple of 16
  /// @pre the scene holds a solution
  FinalGather(std::shared_ptr<const LitScene> scene, std::uint32_t rays);

  std::uint32_t rays_per_point() const { return static_cast<std::uint32_t>(tables_.front().size()); }

  /// Indirect irradiance (W/m²) at a point of a surface or in free air.
  /// @param normal  unit
  /// @param seed    chooses one of the ray sets and its turn around the normal
  /// @param rays    grows by the number of rays
  /// @cost about 0.15 µs a ray
  Rgb irradiance(const Vec3& point, const Vec3& normal, std::uint64_t seed, std::uint64_t& rays) const;

 private:
  /// π times the radiance that arrives along a ray whose first hit is `at`: on from mirrors, gloss and glass, and from
  /// hits that are too near.
  Rgb seen_radiosity(SurfacePoint at, Vec3 direction, double distance, std::uint64_t seed, std::uint64_t& rays) const;

  std::shared_ptr<const LitScene> scene_;
  std::vector<std::uint8_t> scatters_;     ///< of each surface: a ray goes on from it
  double near_;                            ///< m; hits below this distance are not answered by their element
  std::vector<std::vector<Vec3>> tables_;  ///< sets of local directions, sorted so that sixteen in a row are neighbours
};

}  // namespace lichthof
