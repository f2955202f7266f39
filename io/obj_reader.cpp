#include "io/obj_reader.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>

#include "io/image_writer.hpp"
#include "io/mtl_reader.hpp"
#include "io/obj_text.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t longest_texture_side = 2048;
constexpr std::uint64_t most_texels = 1u << 26;  // of a scene: 768 MiB

/// A material of the file and where it was defined.
struct Defined {
  MtlMaterial material;
  std::string file;
};
using Library = std::map<std::string, Defined, std::less<>>;

class ObjReader {
 public:
  ObjReader(const std::string& path, ObjText obj, Scene& scene, FaceList& faces, ImportReport& report)
      : path_(path), obj_(std::move(obj)), scene_(scene), faces_(faces), report_(report) {}

  Status read(const FileFrame& frame, const Placement& placement);

 private:
  Status read_libraries();
  Status read_library(const std::string& file);
  Status resolve_materials();
  Expected<std::uint32_t> texture(const Defined& defined);
  std::uint32_t shared_material(const Material& material);
  void add_faces(const FileFrame& frame, const Placement& placement);

  const std::string& path_;
  ObjText obj_;
  Scene& scene_;
  FaceList& faces_;
  ImportReport& report_;
  Library library_;
  std::vector<std::uint32_t> material_ids_;  ///< per name in obj_.materials
};

Status ObjReader::read_library(const std::string& file) {
  Expected<std::vector<MtlMaterial>> materials = read_mtl(file, report_);
  if (!materials) return materials.error();
  for (MtlMaterial& material : *materials) {
    const std::string name = material.material.name;
    const std::uint32_t line = material.line;
    if (!library_.try_emplace(name, Defined{std::move(material), file}).second)
      report_.note("material defined twice", at_line(file, line) + ": material " + in_quotes(name) +
                                                 " is defined in an earlier file, too, which counts");
  }
  return Done{};
}

Status ObjReader::read_libraries() {
  const fs::path folder = fs::path(path_).parent_path();
  std::error_code problem;
  for (const ObjText::Name& library : obj_.libraries) {
    // The whole rest of the line is one name with blanks, if such a file exists; else names separated by blanks.
    std::vector<std::string> names;
    if (fs::exists(folder / library.text, problem)) {
      names.push_back(library.text);
    } else {
      std::string_view rest = library.text;
      for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) names.emplace_back(word);
    }
    for (std::string& name : names) {
      std::replace(name.begin(), name.end(), '\\', '/');
      if (!fs::exists(folder / name, problem))
        return bad_input(at_line(path_, library.line),
                         "the material file " + in_quotes(name) + " does not exist beside the OBJ file");
      if (Status read = read_library((folder / name).string()); !read) return read;
    }
  }
  return Done{};
}

/// Index of the texture of a material, loaded once per file.
Expected<std::uint32_t> ObjReader::texture(const Defined& defined) {
  const fs::path file = fs::path(defined.file).parent_path() / defined.material.texture_file;
  for (std::uint32_t i = 0; i < scene_.textures.size(); ++i)
    if (scene_.textures[i].name == file.string()) return i;
  const std::string where = at_line(defined.file, defined.material.texture_line);
  Expected<Image> image = read_image(file.string(), longest_texture_side);
  if (!image)
    return bad_input(where, "the texture " + in_quotes(defined.material.texture_file) + " " + image.error().message);
  std::uint64_t texels = std::uint64_t{image->width} * image->height;
  for (const Texture& other : scene_.textures) texels += std::uint64_t{other.width} * other.height;
  if (texels > most_texels)
    return bad_input(where, "the textures have more than 67 million pixels in all; scale them down");
  bool outside = false;
  for (float& value : image->rgb) {
    const float kept = value >= 0 ? std::min(value, 1.f) : 0.f;  // NaN becomes 0
    outside |= kept != value;
    value = kept;
  }
  if (outside)
    report_.note("texture out of range", where + ": the texture " + in_quotes(defined.material.texture_file) +
                                             " has values outside 0..1, which no reflectance can have; cut off");
  scene_.textures.push_back({file.string(), image->width, image->height, std::move(image->rgb)});
  return static_cast<std::uint32_t>(scene_.textures.size() - 1);
}

std::uint32_t ObjReader::shared_material(const Material& material) {
  const auto same = [&material](const Material& other) {
    return other.name == material.name && other.reflectance == material.reflectance &&
           other.radiance == material.radiance && other.specular == material.specular &&
           other.exponent == material.exponent && other.refractive_index == material.refractive_index &&
           other.finish == material.finish && other.texture == material.texture;
  };
  const auto known = std::find_if(scene_.materials.begin(), scene_.materials.end(), same);
  if (known != scene_.materials.end()) return static_cast<std::uint32_t>(known - scene_.materials.begin());
  scene_.materials.push_back(material);
  return static_cast<std::uint32_t>(scene_.materials.size() - 1);
}

Status ObjReader::resolve_materials() {
  std::map<std::string_view, std::uint32_t> ids;
  // In the order of the files, whether used or not: the report names those without use.
  std::vector<const Defined*> ordered;
  for (const auto& [name, defined] : library_) ordered.push_back(&defined);
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const Defined* a, const Defined* b) { return a->material.line < b->material.line; });
  for (const Defined* defined : ordered) {
    Material material = defined->material.material;
    if (!defined->material.texture_file.empty()) {
      const Expected<std::uint32_t> index = texture(*defined);
      if (!index) return index.error();
      material.texture = *index;
    }
    ids[defined->material.material.name] = shared_material(material);
  }
  std::vector<char> used(obj_.materials.size(), 0);
  for (const ObjText::Face& face : obj_.faces)
    if (face.material != ObjText::none) used[face.material] = 1;
  for (std::size_t i = 0; i < obj_.materials.size(); ++i) {
    const auto id = ids.find(obj_.materials[i].text);
    material_ids_.push_back(id == ids.end() ? ObjText::none : id->second);
    if (id != ids.end() || !used[i]) continue;
    return bad_input(
        at_line(path_, obj_.materials[i].line),
        "material " + in_quotes(obj_.materials[i].text) + " is not defined" +
            (obj_.libraries.empty() ? ": the file names no material file (mtllib)" : " in the material files"));
  }
  return Done{};
}

void ObjReader::add_faces(const FileFrame& frame, const Placement& placement) {
  const double angle = placement.rotate_z_deg * std::numbers::pi / 180.0, c = std::cos(angle), s = std::sin(angle);
  const bool placed = placement.scale != 1 || placement.rotate_z_deg != 0 || placement.translate != Vec3{0.0};
  const auto world = [&](const Vec3& p) {
    if (!placed) return frame.point_to_world(p);
    const Vec3 d = placement.scale * frame.direction_to_world(p);
    const Vec3 turned{c * d.x - s * d.y, s * d.x + c * d.y, d.z};
    return frame.metres_per_unit * (turned + frame.direction_to_world(placement.translate));
  };
  const auto part = static_cast<std::uint16_t>(faces_.parts.size());
  faces_.parts.push_back(path_);
  std::optional<std::uint32_t> plain;
  std::vector<std::uint32_t> groups;
  for (const ObjText::Name& group : obj_.groups) groups.push_back(faces_.group(group.text));
  for (const ObjText::Face& face : obj_.faces) {
    FaceList::Face added{static_cast<std::uint32_t>(faces_.corners.size()), face.count, 0, face.line, part, true, {}};
    if (face.group != ObjText::none) added.origin.group = groups[face.group];
    for (std::uint32_t i = face.first; i < face.first + face.count; ++i) {
      const ObjText::Corner& corner = obj_.corners[i];
      faces_.corners.push_back(world(obj_.vertices[corner.vertex]));
      added.textured &= corner.texcoord != ObjText::none;
      faces_.texcoords.push_back(corner.texcoord == ObjText::none ? Vec2{0.0} : obj_.texcoords[corner.texcoord]);
    }
    if (face.material == ObjText::none) {
      if (!plain) {
        report_.note("no material",
                     at_line(path_, face.line) + ": the face has no material (usemtl); it reflects 50 %");
        Material material;
        material.name = "default";
        plain = shared_material(material);
      }
      added.material = *plain;
    } else {
      added.material = material_ids_[face.material];
    }
    const bool needs_texcoords = scene_.materials[added.material].texture.has_value();
    if (needs_texcoords && !added.textured)
      report_.note("no texture coordinates",
                   at_line(path_, face.line) + ": the face has a texture, but no texture coordinates");
    faces_.faces.push_back(added);
  }
}

Status ObjReader::read(const FileFrame& frame, const Placement& placement) {
  if (faces_.corners.size() + obj_.corners.size() >= ObjText::none)
    return bad_input(path_, "more than 4 billion corners in all");
  if (!obj_.first_unknown.text.empty())
    report_.note("unknown keyword", at_line(path_, obj_.first_unknown.line) + ": unknown keyword " +
                                        in_quotes(obj_.first_unknown.text) + "; such lines are passed over");
  if (obj_.ignored_curves > 0)
    report_.note("curves", path_ + ": " + std::to_string(obj_.ignored_curves) +
                               " lines, points or curves have no area; passed over");
  if (Status read = read_libraries(); !read) return read;
  if (Status resolved = resolve_materials(); !resolved) return resolved;
  add_faces(frame, placement);
  return Done{};
}

}  // namespace

Status read_obj(const std::string& path, const FileFrame& frame, const Placement& placement, Scene& scene,
                FaceList& faces, ImportReport& report) {
  Expected<ObjText> obj = read_obj_text(path);
  if (!obj) return obj.error();
  return ObjReader(path, std::move(*obj), scene, faces, report).read(frame, placement);
}

}  // namespace lichthof::io
