#include "io/glb_writer.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/bytes.hpp"

namespace lichthof::io {

namespace {

using Json = nlohmann::ordered_json;

// Numbers of the specification.
constexpr int unsigned_short = 5123, unsigned_int = 5125, float_number = 5126;
constexpr int array_buffer = 34962, element_array_buffer = 34963, triangles_mode = 4;
constexpr std::uint32_t glb_magic = 0x46546C67, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;

Vec3 y_up(const Vec3& p) { return {p.x, p.z, -p.y}; }

/// The buffer and its description grow together.
class Glb {
 public:
  Glb(const ElementModel& model, std::span<const Rgb> colours, std::span<const Material> materials)
      : model_(model), colours_(colours), materials_(materials) {}
  Status write(const std::string& path);

 private:
  int add_view(std::size_t begin, int target, int stride = 0);
  int add_accessor(int view, std::size_t offset, int component, std::size_t count, const char* type);
  void add_vertices();
  void add_primitives();

  const ElementModel& model_;
  std::span<const Rgb> colours_;
  std::span<const Material> materials_;
  ByteWriter buffer_;
  Json views_ = Json::array(), accessors_ = Json::array(), primitives_ = Json::array(), material_list_ = Json::array();
  Json attributes_ = Json::object();
  Vec3 origin_{0.0};
};

int Glb::add_view(std::size_t begin, int target, int stride) {
  Json view = {
      {"buffer", 0}, {"byteOffset", begin}, {"byteLength", buffer_.bytes().size() - begin}, {"target", target}};
  if (stride > 0) view["byteStride"] = stride;
  views_.push_back(view);
  return static_cast<int>(views_.size()) - 1;
}

int Glb::add_accessor(int view, std::size_t offset, int component, std::size_t count, const char* type) {
  accessors_.push_back(
      {{"bufferView", view}, {"byteOffset", offset}, {"componentType", component}, {"count", count}, {"type", type}});
  return static_cast<int>(accessors_.size()) - 1;
}

void Glb::add_vertices() {
  // Single precision far from the origin would show as jagged walls: the node carries the way there.
  Box box;
  for (const ElementModel::Vertex& vertex : model_.vertices) box.include(y_up(vertex.position));
  origin_ = box.centre();
  Rgbf lo{1e30f}, hi{-1e30f};
  std::size_t begin = buffer_.bytes().size();
  for (const ElementModel::Vertex& vertex : model_.vertices) {
    const Rgbf local{y_up(vertex.position) - origin_};
    lo = glm::min(lo, local), hi = glm::max(hi, local);
    buffer_.put(local);
  }
  const std::size_t count = model_.vertices.size();
  attributes_["POSITION"] = add_accessor(add_view(begin, array_buffer), 0, float_number, count, "VEC3");
  accessors_.back()["min"] = {lo.x, lo.y, lo.z};
  accessors_.back()["max"] = {hi.x, hi.y, hi.z};

  begin = buffer_.bytes().size();
  for (const ElementModel::Vertex& vertex : model_.vertices) buffer_.put(Rgbf{y_up(vertex.normal)});
  attributes_["NORMAL"] = add_accessor(add_view(begin, array_buffer), 0, float_number, count, "VEC3");

  // Three shorts padded to eight bytes: attributes start at multiples of four.
  begin = buffer_.bytes().size();
  for (const Rgb& colour : colours_) {
    for (int c = 0; c < 3; ++c) buffer_.put(static_cast<std::uint16_t>(std::lround(65535.0 * colour[c])));
    buffer_.put(std::uint16_t{65535});
  }
  attributes_["COLOR_0"] = add_accessor(add_view(begin, array_buffer, 8), 0, unsigned_short, count, "VEC4");
  accessors_.back()["normalized"] = true;

  begin = buffer_.bytes().size();
  for (const ElementModel::Vertex& vertex : model_.vertices) buffer_.put(Rgbf{vertex.radiosity});
  attributes_["_RADIOSITY"] = add_accessor(add_view(begin, array_buffer), 0, float_number, count, "VEC3");
}

void Glb::add_primitives() {
  std::vector<std::vector<std::uint32_t>> triangles(materials_.size());
  for (const ElementModel::Face& face : model_.faces)
    for (std::uint32_t k = 1; k + 1 < face.count; ++k)
      for (const std::uint32_t corner : {0u, k, k + 1})
        triangles[face.material].push_back(model_.corners[face.first + corner]);
  for (std::size_t m = 0; m < triangles.size(); ++m) {
    if (triangles[m].empty()) continue;
    const std::size_t begin = buffer_.bytes().size();
    for (const std::uint32_t index : triangles[m]) buffer_.put(index);
    const int indices =
        add_accessor(add_view(begin, element_array_buffer), 0, unsigned_int, triangles[m].size(), "SCALAR");
    primitives_.push_back({{"attributes", attributes_},
                           {"indices", indices},
                           {"material", material_list_.size()},
                           {"mode", triangles_mode}});
    material_list_.push_back({{"name", materials_[m].name},
                              {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 1}}, {"metallicFactor", 0}}},
                              {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
  }
}

Status Glb::write(const std::string& path) {
  add_vertices();
  add_primitives();
  const Json document = {{"asset", {{"version", "2.0"}, {"generator", "lichthof"}}},
                         {"extensionsUsed", {"KHR_materials_unlit"}},
                         {"scene", 0},
                         {"scenes", Json::array({{{"nodes", {0}}}})},
                         {"nodes", Json::array({{{"mesh", 0}, {"translation", {origin_.x, origin_.y, origin_.z}}}})},
                         {"meshes", Json::array({{{"primitives", primitives_}}})},
                         {"materials", material_list_},
                         {"buffers", Json::array({{{"byteLength", buffer_.bytes().size()}}})},
                         {"bufferViews", views_},
                         {"accessors", accessors_}};
  // A name that is no UTF-8 must not stop the export.
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + 8 + buffer_.bytes().size();
  if (total > 0xffffffffull)
    return Error{ErrorCode::failed, path, "the model has more than 4 GiB, the most a .glb can have; export .ply"};
  ByteWriter head;
  for (const std::uint64_t word :
       {std::uint64_t{glb_magic}, std::uint64_t{2}, total, std::uint64_t{text.size()}, std::uint64_t{json_chunk}})
    head.put(static_cast<std::uint32_t>(word));
  ByteWriter binary_head;
  binary_head.put(static_cast<std::uint32_t>(buffer_.bytes().size()));
  binary_head.put(binary_chunk);

  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  for (const std::string_view part : {std::string_view(head.bytes()), std::string_view(text),
                                      std::string_view(binary_head.bytes()), std::string_view(buffer_.bytes())})
    if (Status written = file->append(part); !written) return written;
  return file->commit();
}

}  // namespace

Status write_glb(const std::string& path, const ElementModel& model, std::span<const Rgb> colours,
                 std::span<const Material> materials) {
  return Glb(model, colours, materials).write(path);
}

}  // namespace lichthof::io
