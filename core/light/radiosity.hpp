/// What the elements of a cell have received and shot, and who is to shoot next.
///
/// B = E + ρH is the radiosity of an element, S what it has shot, ΔB = B - S its unshot radiosity; ΔB may be negative.
/// Light transfer is linear, so the order of shots changes the path of the solution and not its end.
#pragma once

#include <array>
#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/receiver_tree.hpp"

namespace lichthof {

/// Channels apart, lanes together: what one vector of receivers holds (W/m²).
struct alignas(64) ClusterLight {
  Sums16 received;         ///< H
  Sums16 direct;           ///< the part of H straight from luminaires
  float shot[3][16] = {};  ///< S; what a shot sends is rounded to fit
  double irradiance(int channel, std::uint32_t lane) const {
    return static_cast<double>(received.value[channel][lane]) + static_cast<double>(received.rest[channel][lane]);
  }
};

struct PatchLight {
  Rgb reflectance{0.0};
  Rgb exitance{0.0};       ///< E (W/m²)
  Rgb received_w{0.0};     ///< Σ H A (W)
  Rgb shot_w{0.0};         ///< Σ S A (W)
  Rgb emission_shot{0.0};  ///< the part of E that is in S already (W/m²)
  double area = 0;         ///< m²
  Rgb unshot_w() const { return exitance * area + reflectance * received_w - shot_w; }
};

class Radiosity {
 public:
  Radiosity(const Mesh& mesh, const ReceiverTree& tree);

  std::vector<ClusterLight> clusters;  ///< index as ReceiverTree::clusters
  std::vector<PatchLight> patches;     ///< index as ReceiverTree::patches

  /// Recomputes a group's unshot power after its patches have changed. Safe for different groups at the same time.
  void update_group(std::uint32_t local_group);

  /// What the patches of this cell may expect from this cell's own unshot light, by the closure measured on its own shots.
  /// Other cells are left out on purpose: what is known of them is always late, and overshooting on late news diverges.
  ExpectedLight expected() const;

  /// The group with the largest |ΔB + ρ e| A, summed over channels.
  CellLight::Candidate strongest();

  /// Records a shot of this cell and how much of it arrived here (W).
  void record_closure(const Shot& shot, const Rgb& received_w);

  /// Moves ΔB + ρe of every element of a group into S. @returns the shot without its geometry
  void take(std::uint32_t local_group, Shot& shot);

  CellOutlook outlook() const;
  CellPower power() const;
  const std::vector<std::uint32_t>& local_group_of() const { return local_group_of_; }
  std::size_t memory_bytes() const;

 private:
  const Mesh& mesh_;
  const ReceiverTree& tree_;
  std::array<std::vector<float>, 3> unshot_w_;  ///< per group and channel: Σ ΔB A
  std::array<std::vector<float>, 3> whole_w_;   ///< per group and channel: Σ B A, which says what of it is rounding
  std::array<std::vector<float>, 3>
      answer_w_;  ///< per group and channel: Σ ρ A, the power that 1 W/m² more would leave
  std::array<std::vector<float>, 3> reflected_w_;  ///< per group and channel: Σ ρ H A
  std::array<std::vector<float>, 3> received_w_;   ///< per group and channel: Σ H A
  std::vector<std::uint32_t> local_group_of_;      ///< by mesh group; none if not here
  double area_ = 0;
  ExpectedLight expected_;            ///< as strongest() found it last; take() shoots with the same
  CellOutlook ahead() const;          ///< outlook() without Σ S A, which only the whole scene needs
  Rgb sent_w_{0.0}, arrived_w_{0.0};  ///< of this cell's own shots, in this cell
  Rgb excess_{0.0};                   ///< the most by which one of them exceeded their mean closure, or 1
};

}  // namespace lichthof
