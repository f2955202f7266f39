#include "core/light/balance.hpp"

#include <cmath>

#include "core/light/escape.hpp"

namespace lichthof {

namespace {

/// Of a group (W).
struct Powers {
  double emitted = 0, direct = 0, indirect = 0;         ///< sent on, and arriving
  double reflected_direct = 0, reflected_indirect = 0;  ///< sent on
  double shot = 0;
};

Powers powers_of(const Solution& solution, const Group& group) {
  const Mesh& mesh = *solution.mesh;
  Powers sum;
  for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
    const Patch& patch = mesh.patches[p];
    Rgb direct{0.0}, indirect{0.0}, shot{0.0};
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const double area = mesh.elements[e].area;
      direct += area * Rgb{solution.direct_irradiance[e]};
      indirect += area * solution.indirect(e);
      shot += area * Rgb{solution.shot[e]};
    }
    sum.emitted += patch.area * sum_channels(patch.exitance);
    sum.direct += sum_channels(direct), sum.reflected_direct += sum_channels(patch.reflectance * direct);
    sum.indirect += sum_channels(indirect), sum.reflected_indirect += sum_channels(patch.reflectance * indirect);
    sum.shot += sum_channels(shot);
  }
  return sum;
}

/// As much of what differs from 1 as is more than chance: the mean of what a gain may be, by what it usually is and what was measured
/// [James61]. Light that would have to be none or negative tells of something else than factors that err, and stays as it is.
double told(double gain, double variance) {
  constexpr double usual = 0.05 * 0.05;  // variance of true gains
  return gain > 0 ? 1 + (gain - 1) * usual / (usual + variance) : 1;
}

}  // namespace

void balance(Solution& solution, const Parallel& parallel) {
  const Mesh& mesh = *solution.mesh;
  solution.energy.gain_direct = solution.energy.gain_indirect = 1;
  std::vector<Powers> powers(mesh.groups.size());
  std::vector<double> weights(mesh.groups.size(), 0.0);
  Powers all;
  for (std::size_t g = 0; g < mesh.groups.size(); ++g) {
    if (!mesh.group_is_lit[g]) continue;
    const Powers& p = powers[g] = powers_of(solution, mesh.groups[g]);
    weights[g] = std::abs(p.shot);
    all.emitted += p.emitted, all.direct += p.direct, all.indirect += p.indirect;
    all.reflected_direct += p.reflected_direct, all.reflected_indirect += p.reflected_indirect;
  }
  const std::vector<OpenShare> open = open_shares(*solution.scene, mesh, weights, parallel);
  Powers escaped;
  double emitted_variance = 0, variance = 0;
  for (std::size_t g = 0; g < mesh.groups.size(); ++g) {
    const Powers& p = powers[g];
    escaped.shot += open[g].share * p.shot, escaped.emitted += open[g].share * p.emitted;
    escaped.direct += open[g].share * p.reflected_direct, escaped.indirect += open[g].share * p.reflected_indirect;
    emitted_variance += open[g].variance * p.emitted * p.emitted;
    variance += open[g].variance * p.shot * p.shot;
  }
  solution.energy.escaped = escaped.shot;
  const double kept = all.indirect - all.reflected_indirect + escaped.indirect;
  if (!solution.converged || !(all.direct > 0) || !(kept > 0)) return;
  const EnergyLedger& energy = solution.energy;
  const double sent = all.emitted - escaped.emitted;
  // What is not shot yet has not failed to arrive.
  const double unshot = energy.unshot * energy.unshot;
  emitted_variance += unshot, variance += unshot;
  solution.energy.gain_direct =
      told((sent + energy.mirrored_direct) / all.direct, emitted_variance / (all.direct * all.direct));
  const double left =
      sent + energy.mirrored - energy.gain_direct * (all.direct - all.reflected_direct + escaped.direct);
  solution.energy.gain_indirect = told(left / kept, variance / (kept * kept));
}

}  // namespace lichthof
