/// The coarse level of the first pass: what groups exchange, measured by rays before the first shot, and what follows from it
/// for all of the light: about how much arrives where, and how much it matters there what a group has not shot yet.
///
///     X_gh = A_g F_gh     P_h = D_h + Σ_g X_gh ρ_g P_g / A_g     Y_g = Σ_h X_gh / A_g (1 / R_h + ρ_h Y_h)
///
/// X is the exchange area of two groups (m²), P the power that arrives (W), D what of it comes straight from luminaires, R the power
/// that arrives in a group's region, Y the importance of a group: the relative change of the light where it arrives, over all
/// bounces, for each watt it shoots. All of them are good to some tenths. They decide about order, stopping and detail, never
/// about light: a figure of the solution owes nothing to them.
///
/// @source importance as the adjoint of radiosity [Smits92]; a coarse level beside the shots as in two-level iterations
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/footprint.hpp"
#include "core/base/parallel.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

class GroupExchange {
 public:
  /// @cost about 130 000 rays, or 64 a group where there are very many; some 20 ms. The answer does not depend on the threads
  GroupExchange(const Scene& scene, const Mesh& mesh, const Parallel& parallel);

  struct Link {
    std::uint32_t group = 0;  ///< index into Mesh::groups
    float area = 0;           ///< X (m²)
  };
  /// With whom a group exchanges light, in ascending order; nobody if it is dormant.
  std::span<const Link> links(std::uint32_t group) const {
    return {links_.data() + first_link_[group], links_.data() + first_link_[group + 1]};
  }
  /// Irradiance and radiosity, emission included, means over a group, channels summed (W/m²).
  double irradiance(std::uint32_t group) const { return irradiance_[group]; }
  double radiosity(std::uint32_t group) const { return radiosity_[group]; }
  /// By how much a group's unshot power counts for more than that of a luminaire in its own room: max(1, Y · the power of the
  /// strongest luminaire's group). At a share eps of that power, weighed so, the unshot light of a group changes the light of no
  /// room by more than about eps.
  double weight(std::uint32_t group) const { return weight_[group]; }
  std::size_t memory_bytes() const {
    return bytes_of_all(first_link_, links_, irradiance_, radiosity_, weight_);
  }

 private:
  void measure(const Scene& scene, const Mesh& mesh, const Parallel& parallel);
  void forecast(const Mesh& mesh, std::span<const double> direct_w);

  std::vector<std::uint32_t> first_link_;
  std::vector<Link> links_;
  std::vector<double> irradiance_, radiosity_, weight_;
};

/// Power of the strongest luminaire's group among these (W): the scale of eps. Facets of a lamp in one block count as the one group
/// that they would be if it were flat: else all of the scene would be shot down to a share of a facet. Not more of them than leave
/// every facet far above what is left unshot.
double power_of_strongest_luminaire(const Mesh& mesh, std::span<const std::uint32_t> groups);

}  // namespace lichthof
