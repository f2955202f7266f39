#include "io/scene_reader.hpp"

#include <algorithm>
#include <filesystem>

#include "io/coplanar_faces.hpp"
#include "io/face_list.hpp"
#include "io/obj_reader.hpp"
#include "io/scene_file.hpp"
#include "io/scene_survey.hpp"
#include "io/text.hpp"
#include "io/vs3_reader.hpp"

namespace lichthof::io {

Expected<double> metres_per_unit(std::string_view unit, const std::string& where) {
  if (unit == "mm") return 0.001;
  if (unit == "cm") return 0.01;
  if (unit == "m") return 1.0;
  if (unit == "in") return 0.0254;
  if (unit == "ft") return 0.3048;
  return bad_input(where, "unknown unit " + in_quotes(unit) + "; mm, cm, m, in or ft were expected");
}

Expected<bool> is_y_up(std::string_view axis, const std::string& where) {
  if (axis == "y" || axis == "z") return axis == "y";
  return bad_input(where, "unknown up axis " + in_quotes(axis) + "; y or z was expected");
}

Expected<FileFrame> frame_with(FileFrame frame, const ReadOptions& options) {
  if (options.unit) {
    const Expected<double> metres = metres_per_unit(*options.unit, "--unit");
    if (!metres) return metres.error();
    frame.metres_per_unit = *metres;
  }
  if (options.up) {
    const Expected<bool> y_up = is_y_up(*options.up, "--up");
    if (!y_up) return y_up.error();
    frame.y_up = *y_up;
  }
  return frame;
}

namespace {

Status read_bare_scene(const std::string& path, const ReadOptions& options, bool vs3, LoadedScene& loaded,
                       FaceList& faces) {
  const Expected<FileFrame> frame = frame_with({}, options);
  if (!frame) return frame.error();
  loaded.scene.file_frame = *frame;
  return vs3 ? read_vs3(path, *frame, loaded.scene, faces, loaded.report)
             : read_obj(path, *frame, {}, loaded.scene, faces, loaded.report);
}

/// A patch size far too small asks the mesher for more patches than any machine holds.
Status patch_size_fits(const std::string& path, const Scene& scene) {
  constexpr double most_patches = 1e8, most_blocks = 60000;
  if (!scene.patch_size) return Done{};
  double area = 0;
  for (const Surface& surface : scene.surfaces) area += surface.area;
  const double patch = *scene.patch_size;
  if (2 * area / (patch * patch) <= most_patches && max_channel(bounds(scene).size()) / (2 * patch) <= most_blocks)
    return Done{};
  return bad_input(path, "the patch size of " + shortest_number(patch) +
                             " m would make more than a hundred million patches; choose a larger one");
}

}  // namespace

Expected<LoadedScene> read_scene(const std::string& path, const ReadOptions& options) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending != ".obj" && ending != ".toml" && ending != ".vs3")
    return bad_input(path, "unknown kind of scene; .obj or .toml was expected (or View3D's .vs3)");

  LoadedScene loaded;
  loaded.report.file = path;
  FaceList faces;
  const Status read = ending == ".toml" ? read_scene_file(path, options, loaded.scene, faces, loaded.report)
                                        : read_bare_scene(path, options, ending == ".vs3", loaded, faces);
  if (!read) return read.error();
  if (Status made = make_surfaces(faces, loaded.scene, loaded.report, options.keep_backs); !made) return made.error();
  if (loaded.scene.surfaces.empty()) return bad_input(path, "has no face with an area");
  const auto name = [&faces](const Surface& surface) { return faces.where(surface.source_face - 1); };
  cut_overlaps(loaded.scene, name, loaded.report, options.keep_backs);
  for (const FaceList::Face& face : faces.faces) loaded.origins.push_back(face.origin);
  loaded.groups = std::move(faces.groups);
  survey(loaded.scene, loaded.report);
  if (Status fits = patch_size_fits(path, loaded.scene); !fits) return fits.error();
  return loaded;
}

}  // namespace lichthof::io
