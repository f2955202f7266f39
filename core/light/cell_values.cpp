#include "core/light/cell_values.hpp"

#include <cmath>

namespace lichthof {

namespace {

/// Calls visit(element) for every element of the groups.
template <class Visit>
void for_each_element(const Mesh& mesh, std::span<const GroupId> groups, Visit visit) {
  for (const GroupId id : groups) {
    const Group& group = mesh.groups[id.value];
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
      const Patch& patch = mesh.patches[p];
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) visit(e);
    }
  }
}

}  // namespace

std::vector<float> cell_values(const Solution& solution, std::span<const GroupId> groups) {
  std::vector<float> values;
  for_each_element(*solution.mesh, groups, [&](std::uint32_t e) {
    for (const auto* array : {&solution.irradiance, &solution.direct_irradiance, &solution.shot})
      for (int c = 0; c < 3; ++c) values.push_back((*array)[e][c]);
  });
  return values;
}

Status set_cell_values(Solution& solution, std::span<const GroupId> groups, std::span<const float> values) {
  std::size_t count = 0;
  for_each_element(*solution.mesh, groups, [&](std::uint32_t) { count += values_per_element; });
  if (values.size() != count)
    return Error{ErrorCode::bad_input, "cell",
                 "has " + std::to_string(values.size()) + " values, " + std::to_string(count) + " expected"};
  for (const float value : values)
    if (!std::isfinite(value)) return Error{ErrorCode::bad_input, "cell", "holds a number that is not finite"};
  const float* next = values.data();
  for_each_element(*solution.mesh, groups, [&](std::uint32_t e) {
    for (auto* array : {&solution.irradiance, &solution.direct_irradiance, &solution.shot})
      for (int c = 0; c < 3; ++c) (*array)[e][c] = *next++;
  });
  return Done{};
}

}  // namespace lichthof
