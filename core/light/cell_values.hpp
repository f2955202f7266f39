/// The light of one cell as a row of numbers, taken out of a solution and put back: how cells on other machines hand in
/// what they have, for checkpoints and at the end.
#pragma once

#include <span>
#include <vector>

#include "core/base/expected.hpp"
#include "core/light/cell_light.hpp"

namespace lichthof {

constexpr std::size_t values_per_element = 9;  ///< H, direct H and S, three channels each

/// Of the elements of the groups, group by group, patch by patch (W/m²).
std::vector<float> cell_values(const Solution& solution, std::span<const GroupId> groups);
/// @error bad_input: too few or too many values, or one that is not finite; the solution is as it was
Status set_cell_values(Solution& solution, std::span<const GroupId> groups, std::span<const float> values);

}  // namespace lichthof
