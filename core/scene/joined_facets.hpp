/// Facets of one plane that together are one luminaire are made one surface: it then costs what its light costs, however it was
/// drawn.
#pragma once

#include "core/scene/scene.hpp"

namespace lichthof {

/// Joins emitting surfaces of one material that share a plane, a direction and an edge, as long as what comes of it is convex. Corners
/// must be shared exactly; facets with texture coordinates stay as they are. The first of the facets gives its number of a face.
/// @returns how many surfaces fewer there are
/// @error outlines stay within 1e-9 of the facets' size
/// @cost  O(facets log facets)
std::size_t join_facets(Scene& scene);

}  // namespace lichthof
