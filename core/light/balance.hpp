/// The end of the first pass: its ledger is closed.
///
/// Factors are exact for points; receivers are points in the middle of elements, and shadows are a ray or a few. So what arrives
/// of a shot is not quite what was sent: 1 or 2 % less or more in furnished rooms. Light is neither lost nor made, and how much
/// escapes can be measured. So all direct light is scaled to what luminaires send, and all other light to what surfaces
/// then reflect:
///
///     Φ + M_d = g H_d + Esc(Φ),     Φ + M + ρ (g H_d + k H_i) = g H_d + k H_i + Esc(Φ + ρ (g H_d + k H_i))
///
/// in powers summed over elements and channels; Φ is what is emitted, M what mirrors send on (M_d: of luminaires' light), H_d
/// direct and H_i other light with what is still expected.
#pragma once

#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

/// Measures EnergyLedger::escaped of what has been shot. If the solution has converged, finds EnergyLedger::gain_direct (g) and
/// EnergyLedger::gain_indirect (k) too; of each gain - 1 as much as the noise of what escapes lets be told.
/// @cost  as open_shares()
void balance(Solution& solution, const Parallel& parallel);

}  // namespace lichthof
