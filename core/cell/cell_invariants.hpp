/// What must hold between two steps of a cell, checked from outside: by the simulator after every event, by tests, and by
/// anyone who hunts a hang.
#pragma once

#include <string>

#include "core/cell/cell.hpp"

namespace lichthof {

/// @returns what is broken, or an empty string:
///   - messages received = processed + waiting in joins + waiting as external shots
///   - every waiting join lacks at least one predecessor, and has no part from anyone else
///   - at most one bitmap per divided axis has ever been joined (2 in 2-D, 3 in 3-D)
///   - a cell alone in its grid has sent and received nothing
///   - energy: emitted + received = absorbed + shot + unshot, per channel within rounding
std::string broken_cell_invariant(const Cell& cell);

}  // namespace lichthof
