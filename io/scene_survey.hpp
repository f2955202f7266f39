/// What is worth knowing about a finished scene: its size and power, and faces that lie in each other.
#pragma once

#include <functional>
#include <string>

#include "core/scene/scene.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// Names the face a surface came from, for messages ("office.obj:123").
using FaceNames = std::function<std::string(const Surface&)>;

/// Fills extent, emitters, power, materials, textures, unused materials and overlaps of the report, and notes what looks
/// like a mistake (a scene 500 m across, a luminaire inside the ceiling's plane).
/// @cost  near-linear; the search for overlaps ends after a fixed amount of work and says so
void survey(const Scene& scene, const FaceNames& names, ImportReport& report);

}  // namespace lichthof::io
