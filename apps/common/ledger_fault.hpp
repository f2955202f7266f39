/// What it means that the energy of a first pass does not add up, for people.
#pragma once

#include <string>

#include "core/light/solution.hpp"

namespace lichthof::apps {

/// Where three hundredths of the emitted energy are lost, one is gained, or more is absorbed than emitted: by how much, and the
/// likely cause; empty where the ledger closes.
/// Causes are looked for in this order: a luminaire that is closer to what it lights than it is wide; a first pass that was
/// stopped; surfaces closer to each other than an element; else elements that are too large.
/// @cost  nothing where it closes; else a tree of the scene, and a ray for each luminaire and patch
std::string ledger_fault(const Solution& solution);

}  // namespace lichthof::apps
