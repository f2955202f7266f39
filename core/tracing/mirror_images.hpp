/// Light that comes from luminaires by way of one plane mirror: as the luminaire's image behind the mirror shines through the
/// mirror's outline. Found by chance, as a gather's rays would find it, it is rare and bright: the largest part of the error
/// of scenes that have a mirror.
///
/// What an unobstructed image brings is exact (Lambert's closed form for its part within the outline); how much of it is
/// obstructed on the two legs of the way is found by rays.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/tracing/trace_scene.hpp"

namespace lichthof {

class MirrorImages {
 public:
  /// In scenes of very many mirrors and luminaires none is kept.
  explicit MirrorImages(std::shared_ptr<const TraceScene> scene);

  bool empty() const { return images_.empty(); }
  /// Irradiance (W/m²) through all plane mirrors, by one reflection each.
  /// @param rays_per_image  to each image that brings anything @param rays  grows by the number of rays
  /// @cost  0.5 µs per pair of mirror and luminaire, 2 µs per ray
  Rgb irradiance(const Vec3& point, const Vec3& normal, std::uint32_t rays_per_image, std::uint64_t seed,
                 std::uint64_t& rays) const;
  std::size_t memory_bytes() const;

 private:
  /// A luminaire as one side of a mirror shows it.
  struct Image {
    std::uint32_t mirror = 0, luminaire = 0;  ///< surfaces
    Vec3 mirror_normal;                       ///< unit, of the side that reflects
    Polygon corners;                          ///< behind the mirror, counter-clockwise for those who see it
    Vec3 normal;                              ///< unit, towards them
  };
  void add(std::uint32_t mirror, const Vec3& mirror_normal, std::uint32_t luminaire);
  Polygon within_outline(const Image& image, const Vec3& point) const;

  std::shared_ptr<const TraceScene> scene_;
  std::vector<Image> images_;
};

}  // namespace lichthof
