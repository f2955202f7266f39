/// What is worth knowing about a finished scene: its size and power.
#pragma once

#include "core/scene/scene.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// Fills extent, emitters, power, materials, textures and unused materials of the report, and notes what looks like a mistake
/// (a scene 500 m across). @cost linear
void survey(const Scene& scene, ImportReport& report);

}  // namespace lichthof::io
