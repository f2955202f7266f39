/// What mirrors send to the elements: the first pass begins with it, since its own shots take mirrors for black. What it reflects
/// is shot like any other light.
///
/// Of luminaires, what one plane mirror shows of each (core/tracing/mirror_images). Of surfaces, what mirrors, up to four in a row,
/// show of the light that a first pass of few elements finds.
#pragma once

#include <memory>
#include <optional>

#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"

namespace lichthof {

/// A solution in which nothing is shot yet: irradiance by way of mirrors alone; what it is of luminaires counts as direct.
/// @returns none without plane mirrors, and for the method `hemicube`, which is left as the paper has it
/// @error  of what is obstructed of an image, as 4 rays tell it; of surfaces, as 16 rays to a mirror tell what it shows, without what
///         they got by mirrors before. More than 256 mirrors show no surfaces
/// @cost  a pass of 3 000 elements; 0.5 µs per element and pair of mirror and luminaire, 20 µs where the luminaire is seen, 15 µs
///        per mirror that is; the answer does not depend on the number of threads
std::optional<Solution> light_by_mirrors(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh,
                                         const SolveOptions& options, const Parallel& parallel);

}  // namespace lichthof
