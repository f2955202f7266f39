#include "io/scene_file.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <optional>

#include "io/mtl_reader.hpp"
#include "io/obj_reader.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t largest_file = 4u << 20;
constexpr std::size_t most_parts = 10000;
constexpr double largest_length = 1e9;

/// Walks the tree of one file. The first thing wrong is kept; everything read after it is void.
class SceneFile {
 public:
  SceneFile(const std::string& path, Scene& scene, FaceList& faces, ImportReport& report)
      : path_(path), scene_(scene), faces_(faces), report_(report) {}
  Status read(const toml::table& root, const ReadOptions& options);

 private:
  using Keys = std::initializer_list<std::string_view>;
  struct Range {
    double lo = -largest_length, hi = largest_length;
    bool open = false;  ///< lo itself is no allowed value
  };

  void fail(const toml::node& at, std::string message);
  void allow(const toml::table& table, std::string_view name, Keys keys);
  const toml::table* table(const toml::table& parent, std::string_view key);
  std::vector<const toml::table*> tables(const toml::table& parent, std::string_view key);
  std::optional<std::string> text(const toml::table& table, std::string_view key, bool required = false);
  std::optional<double> number(const toml::table& table, std::string_view key, Range range);
  std::optional<Vec3> vector(const toml::table& table, std::string_view key, Range range, bool required = false);

  void frame(const toml::table& root, const ReadOptions& options);
  Status part(const toml::table& table);
  void camera(const toml::table& table);
  void material(const toml::table& table);

  const std::string& path_;
  Scene& scene_;
  FaceList& faces_;
  ImportReport& report_;
  std::optional<Error> error_;
};

void SceneFile::fail(const toml::node& at, std::string message) {
  if (!error_) error_ = bad_input(at_line(path_, at.source().begin.line), std::move(message));
}

void SceneFile::allow(const toml::table& table, std::string_view name, Keys keys) {
  for (const auto& [key, value] : table) {
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
    std::string known;
    for (const std::string_view allowed : keys) known += (known.empty() ? "" : ", ") + std::string(allowed);
    fail(value, "unknown key " + in_quotes(key.str()) + " in " + std::string(name) + "; known are " + known);
  }
}

const toml::table* SceneFile::table(const toml::table& parent, std::string_view key) {
  const toml::node* node = parent.get(key);
  if (node && !node->is_table()) fail(*node, "[" + std::string(key) + "] was expected to be a table");
  return node ? node->as_table() : nullptr;
}

std::vector<const toml::table*> SceneFile::tables(const toml::table& parent, std::string_view key) {
  std::vector<const toml::table*> result;
  const toml::node* node = parent.get(key);
  if (!node) return result;
  if (!node->is_array() || !node->as_array()->is_homogeneous(toml::node_type::table)) {
    fail(*node, in_quotes(key) + " is written [[" + std::string(key) + "]], a list of tables");
    return result;
  }
  for (const toml::node& item : *node->as_array()) result.push_back(item.as_table());
  return result;
}

std::optional<std::string> SceneFile::text(const toml::table& table, std::string_view key, bool required) {
  const toml::node* node = table.get(key);
  if (!node && required) fail(table, "the key " + in_quotes(key) + " is missing");
  if (!node) return {};
  const std::optional<std::string> value = node->value_exact<std::string>();
  if (!value || value->empty()) fail(*node, in_quotes(key) + " expects a text in quotes");
  return value;
}

std::optional<double> SceneFile::number(const toml::table& table, std::string_view key, Range range) {
  const toml::node* node = table.get(key);
  if (!node) return {};
  const std::optional<double> value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !(*value >= range.lo && *value <= range.hi) || (range.open && *value <= range.lo)) {
    fail(*node, in_quotes(key) + " expects a number from " + shortest_number(range.lo) + " to " +
                    shortest_number(range.hi) + (range.open ? ", above the first" : ""));
    return {};
  }
  return value;
}

std::optional<Vec3> SceneFile::vector(const toml::table& table, std::string_view key, Range range, bool required) {
  const toml::node* node = table.get(key);
  if (!node && required) fail(table, "the key " + in_quotes(key) + " is missing");
  if (!node) return {};
  const toml::array* array = node->as_array();
  Vec3 result{0.0};
  bool good = array && array->size() == 3;
  for (int i = 0; i < 3 && good; ++i) {
    const toml::node& item = (*array)[static_cast<std::size_t>(i)];
    const std::optional<double> value = item.is_number() ? item.value<double>() : std::nullopt;
    good = value && *value >= range.lo && *value <= range.hi;
    if (good) result[i] = *value;
  }
  if (good) return result;
  fail(*node, in_quotes(key) + " expects three numbers, each from " + shortest_number(range.lo) + " to " +
                  shortest_number(range.hi));
  return {};
}

void SceneFile::frame(const toml::table& root, const ReadOptions& options) {
  FileFrame frame;
  if (const auto unit = text(root, "unit")) {
    const Expected<double> metres = metres_per_unit(*unit, at_line(path_, root.get("unit")->source().begin.line));
    if (!metres && !error_) error_ = metres.error();
    if (metres) frame.metres_per_unit = *metres;
  }
  if (const auto up = text(root, "up")) {
    const Expected<bool> y_up = is_y_up(*up, at_line(path_, root.get("up")->source().begin.line));
    if (!y_up && !error_) error_ = y_up.error();
    if (y_up) frame.y_up = *y_up;
  }
  const Expected<FileFrame> asked = frame_with(frame, options);
  if (!asked && !error_) error_ = asked.error();
  if (asked) scene_.file_frame = *asked;
}

Status SceneFile::part(const toml::table& table) {
  allow(table, "[[part]]", {"file", "scale", "rotate_z", "translate"});
  const auto file = text(table, "file", true);
  Placement placement;
  placement.scale = number(table, "scale", {0, 1e6, true}).value_or(1);
  placement.rotate_z_deg = number(table, "rotate_z", {-360, 360}).value_or(0);
  placement.translate = vector(table, "translate", {}).value_or(Vec3{0.0});
  if (error_) return *error_;
  const fs::path whole = fs::path(path_).parent_path() / *file;
  const std::string where = at_line(path_, table.get("file")->source().begin.line);
  if (whole.extension() != ".obj" && whole.extension() != ".OBJ")
    return bad_input(where, "the part " + in_quotes(*file) + " is no OBJ file, the only kind of part that can be read");
  std::error_code problem;
  if (!fs::exists(whole, problem))
    return bad_input(where, "the part " + in_quotes(*file) + " does not exist beside the scene file");
  return read_obj(whole.string(), scene_.file_frame, placement, scene_, faces_, report_);
}

void SceneFile::camera(const toml::table& table) {
  allow(table, "[[camera]]", {"name", "eye", "target", "up", "fov"});
  const FileFrame& frame = scene_.file_frame;
  Camera camera;
  camera.name = text(table, "name", true).value_or("");
  camera.eye = frame.point_to_world(vector(table, "eye", {}, true).value_or(Vec3{0.0}));
  camera.target = frame.point_to_world(vector(table, "target", {}, true).value_or(Vec3{0.0}));
  if (const auto up = vector(table, "up", {})) camera.up = frame.direction_to_world(*up);
  camera.vertical_fov_deg = number(table, "fov", {1, 170}).value_or(camera.vertical_fov_deg);
  if (error_) return;
  const Vec3 sight = camera.target - camera.eye;
  if (glm::length(sight) == 0) return fail(table, "the camera's eye and target are the same point");
  if (glm::length(glm::cross(sight, camera.up)) <= 1e-9 * glm::length(sight) * glm::length(camera.up))
    return fail(table, "the camera looks along its own up direction; give another 'up'");
  for (const Camera& other : scene_.cameras)
    if (other.name == camera.name) return fail(table, "two cameras have the name " + in_quotes(camera.name));
  scene_.cameras.push_back(camera);
}

void SceneFile::material(const toml::table& table) {
  allow(table, "[[material]]", {"name", "reflectance", "emission"});
  const auto name = text(table, "name", true);
  const auto reflectance = vector(table, "reflectance", {0, 1e3});
  const auto emission = vector(table, "emission", {0, 1e12});
  if (error_) return;
  bool found = false;
  for (Material& material : scene_.materials) {
    if (material.name != *name) continue;
    found = true;
    if (reflectance) material.reflectance = *reflectance;
    if (emission) material.radiance = *emission;
    clamp_reflectance(material, at_line(path_, table.source().begin.line), report_);
  }
  if (found) return;
  std::string known;
  for (std::size_t i = 0; i < scene_.materials.size() && i < 8; ++i)
    known += (i ? ", " : "") + printable(scene_.materials[i].name);
  fail(table, "no part has a material " + in_quotes(*name) + "; there are " + known +
                  (scene_.materials.size() > 8 ? ", ..." : ""));
}

Status SceneFile::read(const toml::table& root, const ReadOptions& options) {
  allow(root, "the scene file", {"unit", "up", "mesh", "part", "camera", "material"});
  frame(root, options);
  if (const toml::table* mesh = table(root, "mesh")) {
    allow(*mesh, "[mesh]", {"patch", "element"});
    if (const auto patch = number(*mesh, "patch", {0, largest_length, true}))
      scene_.patch_size = *patch * scene_.file_frame.metres_per_unit;
    if (const auto element = number(*mesh, "element", {0, largest_length, true}))
      scene_.element_size = *element * scene_.file_frame.metres_per_unit;
  }
  const auto parts = tables(root, "part");
  if (!error_ && parts.empty()) return bad_input(path_, "has no [[part]] with a file; there is nothing to see");
  if (parts.size() > most_parts) return bad_input(path_, "has more than " + std::to_string(most_parts) + " parts");
  for (const toml::table* camera_table : tables(root, "camera")) camera(*camera_table);
  if (error_) return *error_;
  for (const toml::table* part_table : parts)
    if (Status read = part(*part_table); !read) return read;
  for (const toml::table* material_table : tables(root, "material")) material(*material_table);
  if (error_) return *error_;
  return Done{};
}

}  // namespace

Status read_scene_file(const std::string& path, const ReadOptions& options, Scene& scene, FaceList& faces,
                       ImportReport& report) {
  const Expected<std::string> text = file_text(path, largest_file);
  if (!text) return text.error();
  // The library's only way to tell a syntax error is to throw; the exception ends here.
  toml::table root;
  try {
    root = toml::parse(*text, path);
  } catch (const toml::parse_error& problem) {
    return bad_input(at_line(path, problem.source().begin.line), "TOML: " + printable(problem.description()));
  }
  return SceneFile(path, scene, faces, report).read(root, options);
}

}  // namespace lichthof::io
