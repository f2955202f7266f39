/// The light still to come: what groups may expect of all that is not yet shot, over all bounces, by what they exchange
/// (core/light/group_exchange).
///
///     G_h A_h = Σ_g X_gh / A_g (U_g + ρ_g A_g G_g)
///
/// U is the unshot power of a group (W, signed), G the irradiance it may still expect (W/m²). The coarse level of the shots: they
/// would bring the same in hundreds. Cohen's ambient term [Cohen88] is this with one group.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/light/group_exchange.hpp"

namespace lichthof {

class ExpectedLight {
 public:
  /// @param groups  indices into Mesh::groups; what others send or take is left out
  ExpectedLight(const GroupExchange& exchange, const Mesh& mesh, std::span<const std::uint32_t> groups);

  struct Unshot {
    Rgbf power{0.f};        ///< U (W)
    Rgbf answer{0.f};  ///< ρ A (m²)
  };
  /// Begins with what was expected last. @param unshot  one entry per group, in their order
  /// @cost some sweeps over the links, about 1 ns each
  void find(std::span<const Unshot> unshot);
  /// G of the group with this number in the list, as found last (W/m²).
  Rgb irradiance(std::size_t group) const { return {light_[group][0], light_[group][1], light_[group][2]}; }
  std::size_t memory_bytes() const;

 private:
  std::vector<std::uint32_t> first_link_;
  std::vector<GroupExchange::Link> links_;  ///< their `group` is a number in the list
  std::vector<float> inverse_area_;
  std::vector<std::array<float, 4>> light_, leaving_;  ///< G, and (U + ρ A G) / A; the fourth is for vectors
};

struct Solution;
/// Solution::pending of a whole scene, by the emission and reflectance of its mesh: nowhere more than what has arrived there. The same
/// to the last bit for the same light, wherever it comes from.
void set_pending(Solution& solution, const GroupExchange& exchange);

}  // namespace lichthof
