/// Binary glTF 2.0, plainly: one JSON chunk, one buffer. https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/element_polygons.hpp"

namespace lichthof::io {

/// @param colours    per vertex, linear, in [0, 1]
/// @param materials  for their names; one primitive for each that has faces
/// @error io; failed when the file would pass 4 GiB, which the format can't say
Status write_glb(const std::string& path, const ElementModel& model, std::span<const Rgb> colours,
                 std::span<const Material> materials);

}  // namespace lichthof::io
