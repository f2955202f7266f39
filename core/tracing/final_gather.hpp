/// Indirect irradiance by looking around: rays over the hemisphere, each of which reads the reflected radiosity where it
/// lands. Sharper than the mesh, because the mesh is only seen from afar.
///
///     E_indirect(p, n) = 1/G Σ ρ H(hit) / q      G rays, q times as dense as cosine-distributed ones; q = 1 to begin with
///
/// A hit nearer than an element sees the mesh too closely: there the ray is not answered by the element but goes on, with
/// direct light sampled on the spot, until it comes from far enough. This is what makes narrow gaps and corners right.
///
/// Emission is left out, since direct light is sampled on its own, except where it comes by way of a mirror, a glossy
/// lobe or a reflection off glass: no shadow ray finds that; and of luminaires that are shared with shadow rays (DirectView).
///
/// Where the first rays do not tell the light well enough more follow, each round twice as many as the one before, guided by what
/// all before have seen (core/tracing/ray_guide). A round is weighed by the square of its rays, whatever it found, and its rays by
/// the density they were drawn from: no ray has a say in its own weight, so there is no bias.
///
/// In a scene without a solution the light that a surface reflects is told by one path of the path tracer.
#pragma once

#include <cstdint>
#include <vector>

#include "core/tracing/lit_scene.hpp"
#include "core/tracing/path_tracer.hpp"
#include "core/tracing/ray_guide.hpp"

namespace lichthof {

struct GatherOptions {
  std::uint32_t least = 128;   ///< rays of the first round, a multiple of 16
  std::uint32_t most = 16384;  ///< of all rounds together, roughly
  double error = 0.02;  ///< relative standard error of all light at the point that ends it; 0: `most` rays everywhere
  /// Where light is hard to find a larger error is put up with, since its rays would bring more elsewhere: the error that ends it grows
  /// with this power of the rays spent, over those of the first round.
  double patience = 0.25;
};

/// Exactly this many rays everywhere (rounded up to a multiple of 16), in rounds where that helps.
GatherOptions fixed_rays(std::uint32_t rays);

/// What rays have found at a point (W/m²).
struct GatheredLight {
  Rgb direct{0.0};  ///< of luminaires that are shared with shadow rays, and of their samples
  Rgb indirect{0.0};
  double variance = 0;  ///< of both together, channels summed ((W/m²)²), of sampling alone
};

class FinalGather {
 public:
  FinalGather(std::shared_ptr<const LitScene> scene, const GatherOptions& options);
  FinalGather(std::shared_ptr<const LitScene> scene, std::uint32_t rays) : FinalGather(scene, fixed_rays(rays)) {}

  /// Light at a point of a surface or in free air, without direct.light.
  /// @param normal  unit
  /// @param direct  what shadow rays found there
  /// @param seed    chooses the rays
  /// @param rays    grows by the number of rays
  /// @cost about 0.15 µs a ray, 1 µs without a solution
  GatheredLight light(const Vec3& point, const Vec3& normal, const DirectView& direct, std::uint64_t seed,
                      std::uint64_t& rays) const;
  /// Indirect light alone (W/m²).
  Rgb irradiance(const Vec3& point, const Vec3& normal, std::uint64_t seed, std::uint64_t& rays) const {
    return light(point, normal, {}, seed, rays).indirect;
  }

 private:
  /// A place in the square of cosine-distributed directions, and the direction (z along the normal).
  struct Way {
    Vec2 square;
    Vec3 local;
  };
  /// Where the rays start.
  struct Stand {
    Vec3 start, across, along, normal;
    const DirectView& direct;
    std::vector<Vec2> squares;  ///< of the samples of direct light
    Vec3 world(const Vec3& local) const { return local.x * across + local.y * along + local.z * normal; }
  };
  /// The emission of shared luminaires, as a ray that runs straight to them counts it.
  struct Straight {
    const DirectView& view;
    double density = 0;  ///< of all rays of the round, on the square
    Rgb light{0.0};      ///< found so far
    void meet(const Scene& scene, const SurfacePoint& at, const Rgb& throughput);
  };

  Stand stand_at(const Vec3& point, const Vec3& normal, const DirectView& direct, double turn) const;
  /// The rays of a round, and the densities they have been drawn from.
  void aim(std::size_t round, const RayGuide& guide, std::uint64_t seed, std::vector<Way>& ways,
           std::vector<double>& densities) const;
  GatheredLight look(const Stand& stand, std::span<const Way> ways, std::span<const double> densities,
                     std::uint64_t seed, std::vector<RayGuide::Found>& found, std::uint64_t& rays) const;
  /// What a round makes of the samples of direct light.
  void add_samples(const Stand& stand, const RayGuide& guide, double count, GatheredLight& light) const;
  /// A hit that sees its element too closely to be answered by it.
  bool is_near(const SurfacePoint& at, double distance) const;
  /// @param spent  rays with all that went on from them
  bool is_enough(double rays, double spent, const GatheredLight& light) const;
  /// π times the radiance that arrives along a ray whose first hit is `at`: on from mirrors, gloss and glass, and from
  /// hits that are too near.
  Rgb seen_radiosity(SurfacePoint at, Vec3 direction, double distance, std::uint64_t seed, Straight& straight,
                     std::uint64_t& rays) const;

  std::shared_ptr<const LitScene> scene_;
  PathTracer paths_;
  GatherOptions options_;
  std::vector<std::uint8_t> scatters_;        ///< of each surface: a ray goes on from it
  double near_;                               ///< m; hits beyond this distance are near to no element
  std::vector<std::vector<Way>> first_;       ///< sets of rays of the first round
  std::vector<std::vector<Vec2>> following_;  ///< places of the rays of each later round, to be shifted and warped
};

}  // namespace lichthof
