#include "io/model_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/bytes.hpp"
#include "io/element_polygons.hpp"
#include "io/glb_writer.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

/// Quotes where a name could be taken for several cells.
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + "\"";
}

Status write_csv(const std::string& path, const Solution& solution) {
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  const Scene& scene = *solution.scene;
  const Mesh& mesh = *solution.mesh;
  Status written = file->append("x,y,z,nx,ny,nz,area,Er,Eg,Eb,Br,Bg,Bb,material\n");
  for (const Patch& patch : mesh.patches) {
    const Plane& plane = mesh.planes[patch.plane.value];
    // The file's axes: a direction turned into the world and back would be the same, so turn back only.
    FileFrame unit_frame = scene.file_frame;
    unit_frame.metres_per_unit = 1;
    const Vec3 n = unit_frame.point_to_file(plane.normal);
    const std::string name = csv_cell(scene.material_of(scene.surfaces[patch.surface.value]).name);
    for (std::size_t e = patch.first_element; e < patch.first_element + patch.element_count && written; ++e) {
      const Vec3 p = scene.file_frame.point_to_file(plane.point(mesh.elements[e].centre));
      const Rgb h = solution.total(e);
      const Rgb b = element_radiosity(solution, patch, e);
      char row[320];
      std::snprintf(row, sizeof row, "%.12g,%.12g,%.12g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,", p.x, p.y,
                    p.z, n.x + 0.0, n.y + 0.0, n.z + 0.0, static_cast<double>(mesh.elements[e].area), h.x, h.y, h.z,
                    b.x, b.y, b.z);
      written = file->append(row + name + "\n");
    }
  }
  return written ? file->commit() : written;
}

/// Eight-bit sRGB or 16-bit linear come from the same tone-mapped value in [0, 1].
std::vector<Rgb> screen_colours(const ElementModel& model, const ToneMapping& tone) {
  std::vector<float> radiance;
  for (const ElementModel::Vertex& vertex : model.vertices)
    for (int channel = 0; channel < 3; ++channel)
      radiance.push_back(static_cast<float>(vertex.radiosity[channel] / std::numbers::pi));
  const double factor = exposure_factor({static_cast<std::uint32_t>(model.vertices.size()), 1, radiance.data()}, tone);
  std::vector<Rgb> colours;
  for (std::size_t i = 0; i < model.vertices.size(); ++i)
    colours.push_back(
        {filmic(factor * radiance[3 * i]), filmic(factor * radiance[3 * i + 1]), filmic(factor * radiance[3 * i + 2])});
  return colours;
}

Status write_ply(const std::string& path, const Solution& solution, const ToneMapping& tone) {
  const ElementModel model = element_model(solution);
  const std::vector<Rgb> colours = screen_colours(model, tone);
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  Status written = file->append(
      "ply\nformat binary_little_endian 1.0\ncomment lichthof: radiosity in W/m2\nelement vertex " +
      std::to_string(model.vertices.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty float radiosity_r\nproperty float radiosity_g\nproperty float radiosity_b\n"
      "element face " +
      std::to_string(model.faces.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < model.vertices.size() && written; ++i) {
    ByteWriter row;
    row.put(solution.scene->file_frame.point_to_file(model.vertices[i].position));
    for (int c = 0; c < 3; ++c) row.put(static_cast<std::uint8_t>(std::lround(255.0 * srgb_encoded(colours[i][c]))));
    row.put(Rgbf{model.vertices[i].radiosity});
    written = file->append(row.bytes());
  }
  for (std::size_t f = 0; f < model.faces.size() && written; ++f) {
    const ElementModel::Face& face = model.faces[f];
    MUST(face.count <= 255);  // a patch has at most 20 corners, clipping to a rectangle adds 4
    ByteWriter row;
    row.put(static_cast<std::uint8_t>(face.count));
    for (std::uint32_t k = face.first; k < face.first + face.count; ++k) row.put(model.corners[k]);
    written = file->append(row.bytes());
  }
  return written ? file->commit() : written;
}

}  // namespace

Status write_model(const std::string& path, const Solution& solution, const ToneMapping& tone) {
  MUST(solution.scene && solution.mesh && solution.irradiance.size() == solution.mesh->elements.size());
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (solution.mesh->elements.empty()) return Error{ErrorCode::failed, path, "the solution has no elements to export"};
  if (ending == ".csv") return write_csv(path, solution);
  if (ending == ".ply") return write_ply(path, solution, tone);
  if (ending == ".glb") {
    const ElementModel model = element_model(solution);
    return write_glb(path, model, screen_colours(model, tone), solution.scene->materials);
  }
  return bad_input(path, "unknown kind of model; .glb, .ply and .csv can be written");
}

}  // namespace lichthof::io
