/// Input files of View3D (`.vs3`, geometry `F 3`): vertices and surfaces of three or four of them, front counter-clockwise.
///
///     T title                               V # x y z
///     S # v1 v2 v3 v4 base cmb emit name    a surface; v4 = 0: a triangle
///     O # v1 v2 v3 v4                       it only obstructs
///     ! or /  comment    C  control, which says nothing about the geometry    E or *  end
///
/// A surface becomes a material of its name, of reflectance 1 - emit. One with a `base` lies in that one's plane, which is cut
/// out there; one with `cmb` counts to that surface.
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/face_list.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// @error bad_input with file:line: no such vertex, numbers out of sequence, masks and null surfaces (`M`, `N`), two
///        dimensions (`F 2`), surfaces by angles (`F 3a`)
Status read_vs3(const std::string& path, const FileFrame& frame, Scene& scene, FaceList& faces, ImportReport& report);

}  // namespace lichthof::io
