/// What the elements of a cell have received and shot, and who is to shoot next.
///
/// B = E + ρH is the radiosity of an element, S what it has shot, ΔB = B - S its unshot radiosity; ΔB may be negative.
/// Light transfer is linear, so the order of shots changes the path of the solution and not its end.
#pragma once

#include <array>
#include <vector>

#include "core/light/cell_light.hpp"
#include "core/light/expected_light.hpp"
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

/// The groups of a tree, as indices into Mesh::groups.
std::vector<std::uint32_t> mesh_groups(const ReceiverTree& tree);

class Radiosity {
 public:
  /// @param exchange  of the mesh
  Radiosity(const Mesh& mesh, const ReceiverTree& tree, const GroupExchange& exchange);

  std::vector<ClusterLight> clusters;  ///< index as ReceiverTree::clusters
  std::vector<PatchLight> patches;     ///< index as ReceiverTree::patches

  /// Recomputes a group's unshot power after its patches have changed. Safe for different groups at the same time.
  void update_group(std::uint32_t local_group);

  /// The group with the largest |ΔB + ρ e| A, summed over channels, times its weight. What is expected (e) is that of this cell's
  /// own unshot light: other cells are left out on purpose, for what is known of them is always late, and overshooting on late
  /// news diverges.
  /// Asked again, it says the same until note_change().
  CellLight::Candidate strongest();
  /// Light, emission or reflectance are others than strongest() knows.
  void note_change() { is_changed_ = true; }

  /// Moves ΔB + ρe of every element of a group into S. @returns the shot without its geometry
  void take(std::uint32_t local_group, Shot& shot);

  CellPower power() const;
  /// Of a group, by emission and reflectance as they are now.
  ExpectedLight::Unshot unshot(std::size_t local_group) const {
    return {sums_[local_group].unshot_w, sums_[local_group].answer};
  }
  const std::vector<std::uint32_t>& local_group_of() const { return local_group_of_; }
  std::size_t memory_bytes() const;

 private:
  const Mesh& mesh_;
  const ReceiverTree& tree_;
  /// What strongest() needs of a group, all channels.
  struct GroupSums {
    Rgbf unshot_w{0.f};    ///< Σ ΔB A
    Rgbf whole_w{0.f};     ///< Σ B A, which says what of it is rounding
    Rgbf answer{0.f};      ///< Σ ρ A (m²), the power that 1 W/m² more would leave
    Rgbf received_w{0.f};  ///< Σ H A
  };
  /// What is expected of groups as found last, and what they had received then: the less, the more has come since.
  struct Expected {
    Rgbf irradiance{0.f};  ///< W/m²
    Rgbf received_w{0.f};
  };
  Rgbf still_expected(std::size_t group) const;
  float key(std::size_t group) const;
  std::size_t strongest_group() const;
  void expect();

  std::vector<GroupSums> sums_;
  std::vector<Expected> expected_;
  std::vector<float> weight_, area_;        ///< of each group: GroupExchange::weight(); m²
  ExpectedLight ahead_;
  float key_then_ = 0;                      ///< the largest when the expected was found
  std::size_t changes_ = 0;                 ///< since then
  CellLight::Candidate strongest_;
  bool is_changed_ = true;
  std::vector<std::uint32_t> local_group_of_;  ///< by mesh group; none if not here
};

}  // namespace lichthof
