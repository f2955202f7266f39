#include "io/solution_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include "core/base/check.hpp"
#include "io/bytes.hpp"
#include "io/scene_bytes.hpp"
#include "io/section_file.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

// Like PNG's: a byte above 127, both line ends and an end-of-file mark, so that text transfers are noticed.
constexpr SectionFormat format{"\x89LHT\r\n\x1a\n", 8, "solution file"};
constexpr std::uint64_t most_head_bytes = 1 << 16, most_scene_bytes = 1ull << 33;

/// What is neither scene nor array.
struct Head {
  SolveOptions options;
  MeshOptions used_mesh;  ///< with the sizes that were really used
  SolveCounters counters;
  EnergyLedger energy;
  double seconds_radiosity = 0;
  bool converged = false;
  std::uint64_t elements = 0, mesh_hash = 0;
};

// Writer and reader list the same fields in the same order; a change of either is a new format version.

void put_mesh_options(ByteWriter& to, const MeshOptions& o) {
  to.put(o.patch_size), to.put(o.element_size), to.put(o.target_elements);
}
void get_mesh_options(ByteReader& from, MeshOptions& o) {
  from.get(o.patch_size), from.get(o.element_size), from.get(o.target_elements);
}

void put_head(ByteWriter& to, const Head& h) {
  put_mesh_options(to, h.options.mesh), put_mesh_options(to, h.used_mesh);
  to.put(h.options.cells), to.put(h.options.hemicube_resolution), to.put(h.options.eps);
  to.put(static_cast<std::uint8_t>(h.options.method));
  const SolveCounters& c = h.counters;
  for (const std::uint64_t value :
       {c.shots, c.rays, c.rays_saved, c.rays_remembered, c.form_factors, c.messages, c.bytes_sent, c.bitmap_bytes,
        c.bitmap_bytes_raw, c.cells_skipped, c.clusters_tested, c.clusters_behind, c.clusters_hidden, c.clusters_cut})
    to.put(value);
  for (const double value :
       {h.energy.emitted, h.energy.absorbed, h.energy.escaped, h.energy.unshot, h.energy.mirrored,
        h.energy.mirrored_direct, h.energy.gain_direct, h.energy.gain_indirect, h.seconds_radiosity})
    to.put(value);
  to.put(static_cast<std::uint8_t>(h.converged));
  to.put(h.elements), to.put(h.mesh_hash);
}

bool get_head(ByteReader& from, Head& h) {
  std::uint8_t method = 0;
  get_mesh_options(from, h.options.mesh), get_mesh_options(from, h.used_mesh);
  from.get(h.options.cells), from.get(h.options.hemicube_resolution), from.get(h.options.eps);
  from.get(method);
  SolveCounters& c = h.counters;
  for (std::uint64_t* value : {&c.shots, &c.rays, &c.rays_saved, &c.rays_remembered, &c.form_factors, &c.messages,
                               &c.bytes_sent, &c.bitmap_bytes, &c.bitmap_bytes_raw, &c.cells_skipped,
                               &c.clusters_tested, &c.clusters_behind, &c.clusters_hidden, &c.clusters_cut})
    from.get(*value);
  for (double* value :
       {&h.energy.emitted, &h.energy.absorbed, &h.energy.escaped, &h.energy.unshot, &h.energy.mirrored,
        &h.energy.mirrored_direct, &h.energy.gain_direct, &h.energy.gain_indirect, &h.seconds_radiosity})
    from.get(*value);
  from.get(h.converged);
  from.get(h.elements), from.get(h.mesh_hash);
  h.options.method = method == 1 ? TransferMethod::hemicube : TransferMethod::rays;
  const auto& cells = h.options.cells;
  const double cell_count = static_cast<double>(cells[0]) * cells[1] * cells[2];
  return from.good() && from.at_end() && method <= 1 && cell_count >= 1 && cell_count <= 1e6 &&
         std::isfinite(h.options.eps) && h.options.hemicube_resolution >= 1 && h.options.hemicube_resolution <= 8192 &&
         std::isfinite(h.used_mesh.patch_size) && h.used_mesh.patch_size > 0 &&
         std::isfinite(h.used_mesh.element_size) && h.used_mesh.element_size > 0 &&
         std::isfinite(h.energy.gain_direct) && h.energy.gain_direct > 0 && std::isfinite(h.energy.gain_indirect) &&
         h.energy.gain_indirect > 0;
}

std::uint64_t mesh_hash(const Mesh& mesh) {
  ByteWriter shape;
  for (const Element& element : mesh.elements) shape.put(element.centre), shape.put(element.area);
  for (const Patch& patch : mesh.patches)
    shape.put(patch.centre), shape.put(patch.area), shape.put(patch.surface.value);
  return checksum(shape.bytes());
}

std::string array_bytes(const std::vector<Rgbf>& values, std::size_t elements) {
  MUST(values.empty() || values.size() == elements);
  if (values.empty()) return std::string(elements * sizeof(Rgbf), '\0');
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Rgbf)};
}

/// Of a surface's lit sides.
constexpr std::size_t bytes_of_surface = 3;

std::string side_bytes(const std::vector<LitSides>& lit) {
  ByteWriter bytes;
  for (const LitSides& sides : lit)
    for (const int byte : {int{sides.front} | int{sides.back} << 1, int{sides.front_coarse}, int{sides.back_coarse}})
      bytes.put(static_cast<std::uint8_t>(byte));
  return bytes.bytes();
}

std::optional<std::vector<LitSides>> sides_from(const std::string& bytes, const Scene& scene) {
  if (!bytes.empty() && bytes.size() != bytes_of_surface * scene.surfaces.size()) return std::nullopt;
  std::vector<LitSides> lit(bytes.size() / bytes_of_surface);
  ByteReader reader(bytes);
  for (LitSides& sides : lit) {
    std::uint8_t which = 0;
    reader.get(which), reader.get(sides.front_coarse), reader.get(sides.back_coarse);
    sides.front = (which & 1) != 0, sides.back = (which & 2) != 0;
    if (std::max(sides.front_coarse, sides.back_coarse) > most_coarse) return std::nullopt;
  }
  return lit;
}

/// Whether meshing can come out near the count the file claims. Asked first, since a crafted size could ask for any number
/// of patches.
bool is_plausible(const Scene& scene, const Head& head, const std::vector<LitSides>& lit) {
  MeshOptions patches = head.used_mesh;
  if (!(patches.patch_size > 0 && std::isfinite(patches.patch_size))) return false;
  patches.element_size = patches.patch_size;
  constexpr double slack = 40;
  const MeshForecast forecast = forecast_of(scene, patches, lit);
  return forecast.blocks < most_blocks &&
         forecast.elements <= slack * (static_cast<double>(head.elements + scene.surfaces.size()) + 100);
}

std::string place_bytes(const std::vector<PlaceTree>& places) {
  ByteWriter bytes;
  for (const PlaceTree& place : places) bytes.put(place.bits());
  return bytes.bytes();
}

/// A place that is divided holds an element in every node that is, and a patch one in every few places: more leaves than here are
/// allowed are none of refined_mesh(). Asked first, since crafted trees could ask for any number of elements.
std::optional<std::vector<PlaceTree>> places_from(const std::string& bytes, std::uint64_t elements) {
  std::vector<PlaceTree> places(bytes.size() / sizeof(std::uint32_t));
  ByteReader reader(bytes);
  std::uint64_t leaves = 0;
  for (PlaceTree& place : places) {
    std::uint32_t bits = 0;
    reader.get(bits);
    place = PlaceTree(bits);
    leaves += place.leaf_count();
  }
  if (!reader.at_end() || leaves > 32 * elements) return std::nullopt;
  return places;
}

Expected<std::shared_ptr<const Mesh>> meshed(const Scene& scene, const Head& head, const std::string& sides,
                                             const std::string& place_bytes, const std::string& path) {
  const std::optional<std::vector<LitSides>> lit = sides_from(sides, scene);
  if (!lit) return bad_input(path, "is damaged: its lit sides do not fit its scene");
  if (!is_plausible(scene, head, *lit)) return bad_input(path, "is damaged: its patch size does not fit its scene");
  const std::optional<std::vector<PlaceTree>> places = places_from(place_bytes, head.elements);
  if (!places) return bad_input(path, "is damaged: its divided places do not fit its elements");
  auto mesh = std::make_shared<const Mesh>(mesh_of(scene, head.used_mesh, *lit, *places));
  if (mesh->elements.size() != head.elements || mesh_hash(*mesh) != head.mesh_hash)
    return bad_input(path, "its mesh comes out differently here (" + std::to_string(mesh->elements.size()) +
                               " elements, " + std::to_string(head.elements) +
                               " expected): it was written by another version of this program; solve again");
  return std::shared_ptr<const Mesh>(std::move(mesh));
}

Status read_array(const SectionFile& file, std::string_view name, std::uint64_t elements, const std::string& path,
                  std::vector<Rgbf>& values) {
  const Expected<std::string> bytes = file.section(name, elements * sizeof(Rgbf));
  if (!bytes) return bytes.error();
  if (bytes->size() % sizeof(Rgbf) != 0 || bytes->size() / sizeof(Rgbf) != elements)
    return bad_input(path, "is damaged: an array has another length than the mesh");
  values.resize(elements);
  if (elements > 0) std::memcpy(static_cast<void*>(values.data()), bytes->data(), bytes->size());
  return Done{};
}

/// @error bad_input, naming element and patch
Status is_finite(const std::vector<Rgbf>& values, std::string_view name, const Mesh& mesh, const std::string& path) {
  const auto bad = std::find_if(values.begin(), values.end(), [](const Rgbf& v) { return !all_finite(Vec3{v}); });
  if (bad == values.end()) return Done{};
  const auto element = static_cast<std::uint32_t>(bad - values.begin());
  const auto after = std::upper_bound(mesh.patches.begin(), mesh.patches.end(), element,
                                      [](std::uint32_t e, const Patch& patch) { return e < patch.first_element; });
  return bad_input(path, "is damaged: " + std::string(name) + " of element " + std::to_string(element) + ", in patch " +
                             std::to_string(after - mesh.patches.begin() - 1) + ", is no finite number");
}

}  // namespace

Status write_solution(const std::string& path, const Solution& solution) {
  MUST(solution.scene && solution.mesh);
  const Mesh& mesh = *solution.mesh;
  const Head head{solution.options,           mesh.options,       solution.counters,    solution.energy,
                  solution.seconds_radiosity, solution.converged, mesh.elements.size(), mesh_hash(mesh)};
  ByteWriter head_bytes;
  put_head(head_bytes, head);
  const std::size_t elements = mesh.elements.size();
  return write_sections(path, format,
                        {{"head", head_bytes.bytes()},
                         {"scene", scene_bytes(*solution.scene)},
                         {"textures", texture_bytes(*solution.scene)},
                         {"sides", side_bytes(mesh.lit_sides)},
                         {"places", place_bytes(mesh.places)},
                         {"H", array_bytes(solution.irradiance, elements)},
                         {"H direct", array_bytes(solution.direct_irradiance, elements)},
                         {"S", array_bytes(solution.shot, elements)},
                         {"pending", array_bytes(solution.pending, elements)}});
}

Expected<Solution> read_solution(const std::string& path) {
  const Expected<SectionFile> file = SectionFile::open(path, format);
  if (!file) return file.error();
  const Expected<std::string> head_bytes = file->section("head", most_head_bytes);
  const Expected<std::string> scene_text = file->section("scene", most_scene_bytes);
  const Expected<std::string> textures = file->section("textures", most_scene_bytes);
  for (const Expected<std::string>* part : {&head_bytes, &scene_text, &textures})
    if (!*part) return part->error();
  Head head;
  ByteReader head_reader(*head_bytes);
  if (!get_head(head_reader, head)) return bad_input(path, "is damaged: its options make no sense");
  Expected<Scene> scene = scene_from(*scene_text, *textures, path);
  if (!scene) return scene.error();
  const Expected<std::string> sides = file->section("sides", bytes_of_surface * scene->surfaces.size());
  if (!sides) return sides.error();
  const Expected<std::string> places = file->section("places", 8 * sizeof(std::uint32_t) * head.elements);
  if (!places) return places.error();

  Solution solution;
  const std::pair<const char*, std::vector<Rgbf>*> arrays[] = {{"H", &solution.irradiance},
                                                               {"H direct", &solution.direct_irradiance},
                                                               {"S", &solution.shot},
                                                               {"pending", &solution.pending}};
  // Before anything is meshed: as many elements as the file claims to have it must hold.
  for (const auto& [name, values] : arrays)
    if (Status read = read_array(*file, name, head.elements, path, *values); !read) return read.error();
  solution.scene = std::make_shared<const Scene>(std::move(*scene));
  Expected<std::shared_ptr<const Mesh>> mesh = meshed(*solution.scene, head, *sides, *places, path);
  if (!mesh) return mesh.error();
  solution.mesh = *mesh;
  solution.options = head.options;
  solution.counters = head.counters;
  solution.energy = head.energy;
  solution.seconds_radiosity = head.seconds_radiosity;
  solution.converged = head.converged;
  for (const auto& [name, values] : arrays)
    if (Status finite = is_finite(*values, name, *solution.mesh, path); !finite) return finite.error();
  return solution;
}

bool is_solution_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  char start[8] = {};
  return file.read(start, sizeof start) && std::string_view(start, sizeof start) == format.magic;
}

}  // namespace lichthof::io
