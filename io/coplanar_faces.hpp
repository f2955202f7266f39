/// Faces that lie in one plane and cover each other: finding them, and leaving each place of a plane to one face.
///
/// Rays leave a face a hair above it, so faces of one plane don't hide each other. Where two of them cover the same place both
/// would receive its light, and both reflect it: energy from nothing, and without end where their reflectances add up to more
/// than 1. So one of them is cut (docs/decisions/0022).
#pragma once

#include <functional>
#include <string>

#include "core/scene/scene.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// Names the face a surface came from, for messages ("office.obj:123").
using FaceNames = std::function<std::string(const Surface&)>;

/// Cuts faces so that they overlap no longer: a luminaire stays whole before what does not emit, then the smaller face before
/// the larger. What is left of a face takes the place of its surface, as convex pieces. Counts and names the pairs.
/// @param keep_backs  a face stays whole where all that would be left of it is nothing, and what covers it looks the other way: the
///                    other side of a thin plate
/// @cost  near-linear; the search ends after a fixed amount of work and says so in the report
void cut_overlaps(Scene& scene, const FaceNames& names, ImportReport& report, bool keep_backs = false);

}  // namespace lichthof::io
