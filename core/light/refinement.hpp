/// Where elements should be smaller: by what the light does there, not by the size of things.
///
/// Direct light is what makes edges, and finer receivers are all that it needs: luminaires shoot element by element. A tile of
/// up to 4x4 elements is fine enough where their direct irradiance lies in a plane; the area integral of the squared deviation
/// from the plane that fits best tells how much a tile adds to the square of the error.
///
/// @source adaptive subdivision [Cohen86], by the deviation from a plane instead of a difference of corners
#pragma once

#include <cstdint>
#include <vector>

#include "core/light/solution.hpp"

namespace lichthof {

/// Σ A d² of each patch over its tiles and channels ((W/m²)² m²). @cost about 0.3 µs an element
std::vector<double> deviations(const Solution& solution);

/// The patches whose refinement takes most of the deviation for the fewest elements, made twice as fine, until no more than a
/// share is expected to be left.
/// @param keep  share in (0, 1) of Σ deviation that may be left
/// @returns     fineness per patch, for mesh_of(); patches at 8 stay. Equal to the mesh's own when nothing can be done
std::vector<std::uint8_t> refined(const Mesh& mesh, const std::vector<double>& deviation, double keep);

}  // namespace lichthof
