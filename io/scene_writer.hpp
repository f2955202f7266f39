/// Scenes back into files: OBJ with MTL and textures, or a scene file (TOML) on top of them.
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::io {

/// `NAME.obj` writes NAME.obj, NAME.mtl and NAME_texture1.png ...; `NAME.toml` writes the same and NAME.toml, which also keeps
/// unit, up axis, patch size and cameras. What read_scene makes of them is the scene again; in metres, to the last bit.
///
/// @param frame  unit and up axis of the numbers to write. An OBJ file can't say them: its reader has to be told
/// @error bad_input: another ending, or a unit that has no name and a scene file to write; io
Status write_scene(const std::string& path, const Scene& scene, const FileFrame& frame);

}  // namespace lichthof::io
