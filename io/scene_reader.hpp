/// The one door for scenes: whatever the file's format, out comes a checked Scene in metres with z up, and a report.
///
///     io::ReadOptions options;
///     options.unit = "mm";                       // only where --unit was given
///     auto loaded = io::read_scene("room.obj", options);
///     if (!loaded) fail(loaded.error());         // one line: "room.obj:17: vertex index 99 is out of range ..."
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/face_list.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

struct ReadOptions {
  std::optional<std::string> unit;  ///< --unit mm|cm|m|in|ft; goes before what a scene file says; else m
  std::optional<std::string> up;    ///< --up y|z; likewise; else z
  bool keep_backs = false;          ///< two faces back to back are both kept: what asks for sides, not for light
};

struct LoadedScene {
  Scene scene;
  ImportReport report;
  std::vector<FaceList::Origin> origins;  ///< of each face read: surfaces name it by their source_face - 1
  std::vector<std::string> groups;        ///< names of OBJ objects and groups
};

/// Reads `.obj` (with its MTL files), `.toml` (see scene_file.hpp) and `.vs3` (see vs3_reader.hpp).
///
/// @returns a scene with at least one surface, everything finite, reflectances in [0, 1), indices in range. It may be
///          without light: report.emitters tells.
/// @error   bad_input, with file:line where there is one and what was expected; io when the system could not read
/// @cost    near-linear; memory in proportion to the files
Expected<LoadedScene> read_scene(const std::string& path, const ReadOptions& options = {});

/// Metres of one unit (mm cm m in ft). @error bad_input naming `where`
Expected<double> metres_per_unit(std::string_view unit, const std::string& where);
/// True for "y", false for "z". @error bad_input naming `where`
Expected<bool> is_y_up(std::string_view axis, const std::string& where);

/// The frame that the options ask for, over one that is already there. @error bad_input naming --unit or --up
Expected<FileFrame> frame_with(FileFrame frame, const ReadOptions& options);

}  // namespace lichthof::io
