/// Where elements should be smaller: by what the light does there, not by the size of things.
///
/// An element is fine enough where its irradiance and its neighbours' lie in a plane; its area times the mean squared deviation from
/// the plane that fits best tells how much it adds to the square of the error. Edges of shadows and places where things nearly
/// touch have most of it. Receivers become finer; light that wants finer shooters wants a finer mesh.
///
/// @source adaptive subdivision [Cohen86], by the deviation from a plane instead of a difference of corners
#pragma once

#include <memory>

#include "core/base/parallel.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// Quarters the elements that have most of the deviation, until no more than a share of it is left. What would become of it is seen
/// by a look at the first of the light with elements a quarter as wide, or half as wide above 25 000 elements: no feature is missed that
/// those meet, but for what mirrors show.
/// @param keep  share in (0, 1) of the deviation that may be left
/// @returns the mesh itself when little can be done: elements an eighth as wide as their place stay, and where all deviate alike all
///          elements may as well be smaller; above a million there is no look
/// @cost    about a first pass
std::shared_ptr<const Mesh> refined_mesh(const std::shared_ptr<const Scene>& scene,
                                         const std::shared_ptr<const Mesh>& mesh, double keep, const Parallel& parallel);

}  // namespace lichthof
