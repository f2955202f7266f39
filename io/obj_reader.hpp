/// One OBJ file with its MTL files and textures, added to a scene that is being read.
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/face_list.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// Where a part goes: scaled, then turned about the vertical axis, then moved; in the file's own unit and axes.
struct Placement {
  double scale = 1;
  double rotate_z_deg = 0;  ///< counter-clockwise seen from above
  Vec3 translate{0.0};
};

/// Adds faces to `faces`, materials and textures to `scene`. Equal materials of several files become one. Textures are
/// shared by file name; larger than 2048 pixels they are scaled down.
/// @error bad_input with file:line: what read_obj_text and read_mtl refuse; a missing MTL file or texture; a face whose
///        material is not defined
Status read_obj(const std::string& path, const FileFrame& frame, const Placement& placement, Scene& scene,
                FaceList& faces, ImportReport& report);

}  // namespace lichthof::io
