/// Direct light at a point, by sampling the luminaires: how much comes is analytic, how much is blocked is found by rays.
///
///     E(p, n) = Σ_i π L_i F_i V_i,   V_i = Σ_k g_k V_k / Σ_k g_k
///
/// F_i is Lambert's closed form for the whole luminaire [Baum89], so unblocked light is exact whatever the number of rays;
/// V_i is the mean visibility of its parts k (a grid of up to 8 x 8), each weighted by its own share g_k of the form
/// factor. Rays go where they matter: a luminaire gets parts by its share of the light that could come.
///
/// Of a sky behind a window most is hidden, and what is seen of it no ray to it may find. Luminaires that a first look finds hidden, in
/// part or as a whole, can be shared with rays that look around from the point: view().
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
  /// Samplings with other seeds, whose mean counts: a luminaire has 64 parts at most, more rays than that go to other places of the
  /// same parts. Places that all points would aim at alike fall into step with slats and railings.
  std::uint32_t rounds = 1;
};

/// Direct light at a point, as far as shadow rays alone tell it, and samples of luminaires that rays which look around from the point find
/// as well. With both, the balance heuristic [Veach95] counts each luminaire once: a sample x of either kind is worth
///
///     π L V / (density + others' density)          densities per unit of the square of cosine-distributed directions
struct DirectView {
  Rgb light{0.0};       ///< irradiance from luminaires that are not shared (W/m²)
  double variance = 0;  ///< of that, channels summed ((W/m²)²), as far as neighbouring rays differ
  struct Sample {
    Vec3 direction;      ///< unit, from the point
    Rgb light{0.0};      ///< π L V (W/m²)
    double density = 0;  ///< of all shadow rays together
  };
  std::vector<Sample> samples;  ///< neighbours in a row; what is hidden brings 0
  struct Shared {
    std::uint32_t surface = 0;
    double density = 0;
  };
  std::vector<Shared> shared;  ///< by surface
  /// Density of samples on a surface; nothing: it is not shared, so whoever meets it must not count its emission.
  std::optional<double> density(std::uint32_t surface) const;
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

  /// The same without bias from one shadow ray, to a luminaire drawn by what it could bring; without images in mirrors.
  /// @cost  10 ns per luminaire and a ray; near to the luminaire drawn, as irradiance() of it
  Rgb one_ray_irradiance(const Vec3& point, const Vec3& normal, Random& random, std::uint64_t& rays) const;

  /// The same, but luminaires that are hidden in part and fill a part of the view worth meeting by chance are left to samples.
  /// Which those are is decided by a look of its own, so that the rays that count know nothing of it.
  /// @cost  as irradiance(), and 64 rays for the look
  DirectView view(const Vec3& point, const Vec3& normal, const DirectOptions& options, std::uint64_t& rays) const;

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
    bool is_bundle = false;  ///< form factor and weight are those of all it is taken for
  };

  /// What shadow rays say of the parts of a luminaire.
  struct Seen {
    double visible = 0, whole = 0;  ///< of its form factor
    double variance = 0;            ///< of `visible`
    bool is_clear = true;           ///< no ray was blocked
  };
  /// Where a ray to a part may go.
  struct Aim {
    const Part* part = nullptr;
    double weight = 0;  ///< form factor of the part
    Vec3 target;        ///< a place of it above the horizon
  };

  void add_parts(Luminaire& luminaire, const Surface& surface, int levels);
  std::span<const Vec3> corners(const Part& part) const {
    return {corners_.data() + part.first_corner, part.corner_count};
  }
  /// Of candidates in the order of the scene: facets of one lamp lie there side by side. Neighbours that are worth no ray each
  /// are replaced by one of them, drawn by weight, that stands for as many as are worth one.
  void bundle(std::vector<Candidate>& candidates, double total, const DirectOptions& options, Random& random) const;
  bool candidate(std::uint32_t luminaire, const Vec3& point, const Vec3& normal, Candidate& out) const;
  std::vector<Candidate> candidates(const Vec3& point, const Vec3& normal, const DirectOptions& options,
                                    double& total) const;
  /// How many of the strongest are worth rays of their own.
  static std::size_t important(std::span<const Candidate> candidates, double total);
  /// @param call  gets each part of the level that may bring light as an Aim
  template <class Call>
  void for_each_aim(const Candidate& candidate, int level, const Vec3& point, const Vec3& normal, Call&& call) const;
  std::vector<Seen> seen(std::span<const Candidate> candidates, double total, const Vec3& point, const Vec3& normal,
                         const DirectOptions& options, std::uint64_t& rays) const;
  Rgb by_mirrors(const Vec3& point, const Vec3& normal, const DirectOptions& options, std::uint64_t& rays) const;
  void add_shared(std::span<const Candidate> candidates, const Vec3& point, const Vec3& normal, std::uint32_t count,
                  std::uint64_t seed, DirectView& view, std::uint64_t& rays) const;
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
