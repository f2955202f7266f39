/// Direct light at a point, by sampling the luminaires: how much comes is analytic, how much is blocked is found by rays.
///
///     E(p, n) = Σ_i π L_i F_i V_i,   V_i = Σ_k g_k V_k / Σ_k g_k
///
/// F_i is Lambert's closed form for the whole luminaire [Baum89], so unblocked light is exact whatever the number of rays;
/// V_i is the mean visibility of its parts k (a grid of up to 8 x 8), each weighted by its own share g_k of the form
/// factor. Rays go where they matter: a luminaire gets parts by its share of the light that could come.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/footprint.hpp"
#include "core/base/random.hpp"
#include "core/tracing/mirror_images.hpp"
#include "core/tracing/trace_scene.hpp"

namespace lichthof {

struct DirectOptions {
  std::uint32_t rays = 256;               ///< shadow rays a point may spend on all luminaires together, roughly
  std::uint32_t most_per_luminaire = 64;  ///< 1, 4, 16 or 64
  /// Set: each ray aims at a random place of its part, drawn from this seed, so that the mean over many samples of a pixel
  /// shows smooth penumbrae. Not set: at its middle; the same point always gives the same light.
  std::optional<std::uint64_t> seed;
  /// To each image of a luminaire in a plane mirror; 0: what comes by way of mirrors is not counted.
  std::uint32_t rays_per_image = 16;
};

class DirectLight {
 public:
  explicit DirectLight(std::shared_ptr<const TraceScene> scene);

  /// True when irradiance() counts what comes by way of one plane mirror.
  bool has_mirror_images() const { return !images_.empty(); }
  std::size_t luminaire_count() const { return luminaires_.size(); }
  /// Power that all luminaires emit (W).
  Rgb power() const { return power_; }

  /// Irradiance (W/m²) on a small plane through `point`, which may lie on a surface or in free air.
  /// @param normal  unit
  /// @param rays    grows by the number of shadow rays
  /// @error none; luminaires that together could bring less than 1e-3 of the light are taken as visible as the others, and facets of
  ///        a lamp that are worth less than a ray each as visible as one of their neighbours
  /// @cost about 1 µs per luminaire with 16 rays
  Rgb irradiance(const Vec3& point, const Vec3& normal, const DirectOptions& options, std::uint64_t& rays) const;

  /// A point on a luminaire for Monte Carlo estimates: by power, then uniform over the area.
  struct Sample {
    Vec3 point, normal;
    Rgb radiance;
    double density = 0;  ///< probability per area (1/m²)
  };
  /// @pre luminaire_count() > 0
  Sample sample(Random& random) const;
  /// The density sample() has on a surface; 0 when it does not emit.
  double density(std::uint32_t surface) const { return density_of_surface_[surface]; }
  std::size_t memory_bytes() const {
    return bytes_of_all(luminaires_, parts_, corners_, cumulative_, density_of_surface_) + images_.memory_bytes();
  }

 private:
  static constexpr int level_count = 4;  ///< 1, 4, 16, 64 parts
  struct Part {
    Vec3 centre{0.0};
    double area = 0;
    double radius = 0;
    std::uint32_t first_corner = 0, corner_count = 0;
  };
  struct Luminaire {
    std::uint32_t surface = 0;
    Rgb radiance{0.0};
    Vec3 centre{0.0}, normal{0.0};
    double area = 0, radius = 0;
    std::array<std::uint32_t, level_count + 1> first_part{};  ///< parts of level k: [k] .. [k + 1]
  };
  /// What one luminaire could bring to a point.
  struct Candidate {
    std::uint32_t luminaire = 0;
    double form_factor = 0;
    double weight = 0;       ///< radiance · form factor, channels summed
    bool straddles = false;  ///< the horizon cuts it
    double distance = 0;
    double stands_for = 0;  ///< weight of all those it is taken for, its own included
  };

  void add_parts(Luminaire& luminaire, const Surface& surface, int levels);
  std::span<const Vec3> corners(const Part& part) const {
    return {corners_.data() + part.first_corner, part.corner_count};
  }
  /// Of candidates in the order of the scene: facets of one lamp lie there side by side. Neighbours that are worth no ray each
  /// are replaced by one of them, drawn by weight, that stands for as many as are worth one.
  static void bundle(std::vector<Candidate>& candidates, double total, const DirectOptions& options, Random& random);
  bool candidate(std::uint32_t luminaire, const Vec3& point, const Vec3& normal, Candidate& out) const;
  int level_for(const Candidate& candidate, double share, const DirectOptions& options) const;

  std::shared_ptr<const TraceScene> scene_;
  MirrorImages images_;
  std::vector<Luminaire> luminaires_;
  std::vector<Part> parts_;
  std::vector<Vec3> corners_;
  std::vector<double> cumulative_;  ///< of power, for sample()
  std::vector<double> density_of_surface_;
  Rgb power_{0.0};
};

}  // namespace lichthof
