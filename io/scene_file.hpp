/// The scene file: a TOML text that names OBJ parts, places them, and adds cameras and changes to materials.
///
///     unit = "m"                # mm cm m in ft; optional, m
///     up = "z"                  # y or z; optional, z
///     [mesh]                    # optional
///     patch = 0.5               # size of a patch, in scene units
///     [[part]]                  # at least one
///     file = "courtyard.obj"    # beside the scene file
///     scale = 1.0               # optional; applied in this order: scale, rotate_z, translate
///     rotate_z = 90             # degrees about the vertical axis, counter-clockwise from above
///     translate = [0, 0, 3]     # in scene units
///     [[camera]]                # the first is the default
///     name = "court"
///     eye = [1, 2, 1.7]
///     target = [5, 5, 1]
///     up = [0, 0, 1]            # optional
///     fov = 60                  # vertical, degrees; optional
///     [[material]]              # changes every material of this name
///     name = "wall"
///     reflectance = [0.7, 0.7, 0.6]
///     emission = [0, 0, 0]      # radiance, W/(m² sr)
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/face_list.hpp"
#include "io/scene_reader.hpp"

namespace lichthof::io {

/// Reads the file and its parts; make_surfaces() has to follow.
/// @error bad_input with file:line: TOML syntax, unknown keys (with the ones that exist), wrong types, values out of range,
///        a material nobody defined; what read_obj refuses
Status read_scene_file(const std::string& path, const ReadOptions& options, Scene& scene, FaceList& faces,
                       ImportReport& report);

}  // namespace lichthof::io
