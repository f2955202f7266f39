/// What luminaires send to the elements by way of one plane mirror: the first pass begins with it, since its own shots take
/// mirrors for black. What it reflects is shot like any other light.
#pragma once

#include <memory>
#include <optional>

#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

/// A solution in which nothing is shot yet: irradiance by way of mirrors alone, counted as direct like all light of luminaires.
/// @returns none when no mirror shows a luminaire, and for the method `hemicube`, which is left as the paper has it
/// @error  of what is obstructed of an image, as 4 rays tell it; else none at the middle of an element
/// @cost  0.5 µs per element and pair of mirror and luminaire, 20 µs where the luminaire is seen; the answer does not depend on the
///        number of threads
std::optional<Solution> light_by_mirrors(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh,
                                         const SolveOptions& options, const Parallel& parallel);

}  // namespace lichthof
