/// What a peer's shot must look like before any arithmetic touches it: a cell never trusts the sizes, places and numbers of
/// a message. What fails here is refused with an event and counts as processed, so that one bad peer can not hang a run.
#pragma once

#include "core/light/cell_light.hpp"
#include "core/protocol/events.hpp"
#include "core/scene/partition.hpp"

namespace lichthof {

/// What can't be about a shot; nothing when it is finite, its values fit into sums in single precision, its frame is orthonormal,
/// its arrays agree in size, and its centre lies in the cell that claims to have shot it. @cost O(elements of the shot)
ShotFault fault_of(const Shot& shot, const CellGrid& grid);

/// Finite and not negative: powers and thresholds.
bool plausible_power(double power_w);

/// True when two copies of a shot come from the same shooter: same stamp, place and size.
bool same_shot(const Shot& a, const Shot& b);

}  // namespace lichthof
