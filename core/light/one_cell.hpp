/// The first pass of a whole scene in one cell, without a protocol: for passes within a pass.
#pragma once

#include "core/light/cell_light.hpp"

namespace lichthof {

/// All groups of a mesh in a cell without bounds.
CellLight light_of_all(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh, const TransferOptions& options,
                       std::shared_ptr<const Parallel> parallel, std::shared_ptr<const GroupExchange> exchange = nullptr);

/// Shoots what a solution has received and not shot, and what luminaires emit, until no group has more than `eps` of what the strongest
/// luminaire's group emits; the solution then holds that. @param parallel  used while this runs
void shoot_in_one_cell(Solution& solution, double eps, const Parallel& parallel);

/// A solution of zeros.
Solution blank_solution(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh);

}  // namespace lichthof
