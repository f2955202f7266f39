#include "io/scene_writer.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "io/atomic_file.hpp"
#include "io/image_writer.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace fs = std::filesystem;

namespace {

constexpr std::pair<std::string_view, double> units[] = {
    {"mm", 0.001}, {"cm", 0.01}, {"m", 1.0}, {"in", 0.0254}, {"ft", 0.3048}};

std::string joined(const Vec3& v, const char* separator = " ") {
  return shortest_number(v.x) + separator + shortest_number(v.y) + separator + shortest_number(v.z);
}

/// Names that MTL can hold: one line, no blanks at the ends, each once.
std::vector<std::string> material_names(const Scene& scene) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const Material& material : scene.materials) {
    std::string name(trimmed(material.name));
    for (char& c : name)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '\\') c = '_';
    if (name.empty()) name = "unnamed";
    const std::string base = name;
    for (int number = 2; !taken.insert(name).second; ++number) name = base + "_" + std::to_string(number);
    names.push_back(name);
  }
  return names;
}

std::string texture_name(const fs::path& stem, std::size_t texture) {
  return stem.filename().string() + "_texture" + std::to_string(texture + 1) + ".png";
}

std::string mtl_text(const Scene& scene, const std::vector<std::string>& names, const fs::path& stem) {
  static constexpr const char* illum[] = {"1", "2", "3", "4"};  // by Finish
  std::string text;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    const Material& m = scene.materials[i];
    text += "newmtl " + names[i] + "\nKd " + joined(m.reflectance) + "\nKs " + joined(m.specular) + "\nKe " +
            joined(m.radiance) + "\nNs " + shortest_number(m.exponent) + "\nNi " + shortest_number(m.refractive_index) +
            "\nillum " + illum[static_cast<std::size_t>(m.finish)] + "\n";
    if (m.texture) text += "map_Kd " + texture_name(stem, *m.texture) + "\n";
    text += "\n";
  }
  return text;
}

/// Numbers each different value from 1 in the order of first use, and lists them.
template <class Value, class Order>
class Numbered {
 public:
  std::size_t number(const Value& value) {
    const auto [entry, is_new] = numbers_.try_emplace(value, numbers_.size() + 1);
    if (is_new) values_.push_back(value);
    return entry->second;
  }
  const std::vector<Value>& values() const { return values_; }

 private:
  std::map<Value, std::size_t, Order> numbers_;
  std::vector<Value> values_;
};

struct ByCoordinates {
  bool operator()(const Vec3& a, const Vec3& b) const { return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z}; }
  bool operator()(const Vec2& a, const Vec2& b) const { return std::array{a.x, a.y} < std::array{b.x, b.y}; }
};

std::string obj_text(const Scene& scene, const std::vector<std::string>& names, const fs::path& stem,
                     const FileFrame& frame) {
  Numbered<Vec3, ByCoordinates> vertices;
  Numbered<Vec2, ByCoordinates> texcoords;
  std::string faces;
  std::uint32_t material = 0xffffffffu;
  for (const Surface& surface : scene.surfaces) {
    if (surface.material != material) {
      material = surface.material;
      faces += "usemtl " + names[material] + "\n";
    }
    faces += "f";
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      faces += " " + std::to_string(vertices.number(frame.point_to_file(surface.corners[k])));
      if (!surface.texcoords.empty()) faces += "/" + std::to_string(texcoords.number(surface.texcoords[k]));
    }
    faces += "\n";
  }
  std::string text = "# lichthof\nmtllib " + stem.filename().string() + ".mtl\n";
  for (const Vec3& v : vertices.values()) text += "v " + joined(v) + "\n";
  for (const Vec2& t : texcoords.values()) text += "vt " + shortest_number(t.x) + " " + shortest_number(t.y) + "\n";
  return text + faces;
}

std::string toml_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  }
  return result + "\"";
}

Expected<std::string> toml_text(const std::string& path, const Scene& scene, const fs::path& stem,
                                const FileFrame& frame) {
  const auto unit = std::find_if(std::begin(units), std::end(units),
                                 [&](const auto& u) { return u.second == frame.metres_per_unit; });
  if (unit == std::end(units))
    return bad_input(path, "a unit of " + shortest_number(frame.metres_per_unit) + " m has no name in a scene file");
  std::string text = "unit = \"" + std::string(unit->first) + "\"\nup = \"" + (frame.y_up ? "y" : "z") + "\"\n";
  if (scene.patch_size || scene.element_size) text += "\n[mesh]\n";
  if (scene.patch_size) text += "patch = " + shortest_number(*scene.patch_size / frame.metres_per_unit) + "\n";
  if (scene.element_size) text += "element = " + shortest_number(*scene.element_size / frame.metres_per_unit) + "\n";
  text += "\n[[part]]\nfile = " + toml_string(stem.filename().string() + ".obj") + "\n";
  for (const Camera& camera : scene.cameras) {
    FileFrame direction = frame;
    direction.metres_per_unit = 1;
    text += "\n[[camera]]\nname = " + toml_string(camera.name) + "\neye = [" +
            joined(frame.point_to_file(camera.eye), ", ") + "]\ntarget = [" +
            joined(frame.point_to_file(camera.target), ", ") + "]\nup = [" +
            joined(direction.point_to_file(camera.up), ", ") + "]\nfov = " + shortest_number(camera.vertical_fov_deg) +
            "\n";
  }
  return text;
}

}  // namespace

Status write_scene(const std::string& path, const Scene& scene, const FileFrame& frame) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending != ".obj" && ending != ".toml")
    return bad_input(path, "unknown kind of scene; .obj and .toml can be written");
  const fs::path stem = fs::path(path).replace_extension();
  Expected<std::string> toml = std::string();
  if (ending == ".toml") toml = toml_text(path, scene, stem, frame);
  if (!toml) return toml.error();

  // What others refer to comes first, so that an interrupted writing leaves no file with holes.
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const Texture& texture = scene.textures[i];
    const std::string file = (stem.parent_path() / texture_name(stem, i)).string();
    if (Status written = write_texture(file, {texture.width, texture.height, texture.rgb.data()}); !written)
      return written;
  }
  const std::vector<std::string> names = material_names(scene);
  if (Status written = write_file(stem.string() + ".mtl", mtl_text(scene, names, stem)); !written) return written;
  const std::string obj_path = ending == ".obj" ? path : stem.string() + ".obj";
  if (Status written = write_file(obj_path, obj_text(scene, names, stem, frame)); !written) return written;
  return ending == ".toml" ? write_file(path, *toml) : Status(Done{});
}

}  // namespace lichthof::io
