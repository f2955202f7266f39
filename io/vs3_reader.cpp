#include "io/vs3_reader.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t longest_file = 1u << 28;
constexpr double largest_coordinate = 1e9;

class Vs3Reader {
 public:
  Vs3Reader(const std::string& path, std::string text, const FileFrame& frame, Scene& scene, FaceList& faces)
      : path_(path), lines_(std::move(text)), frame_(frame), scene_(scene), faces_(faces) {}
  Status read(ImportReport& report);

 private:
  using Problem = std::optional<Error>;
  Error wrong(const std::string& what) const { return bad_input(at_line(path_, lines_.number()), what); }
  Problem whole_number(std::string_view& rest, const char* what, std::int64_t least, std::int64_t most,
                       std::int64_t& value) const;
  Problem real_number(std::string_view& rest, const char* what, double& value) const;
  Problem vertex(std::string_view rest);
  Problem surface(std::string_view rest, bool only_obstructs);
  Problem properties(std::string_view rest, FaceList::Face& face);
  std::uint32_t material(const std::string& name, double reflectance);

  const std::string& path_;
  Lines lines_;
  const FileFrame& frame_;
  Scene& scene_;
  FaceList& faces_;
  std::vector<Vec3> vertices_;
};

Vs3Reader::Problem Vs3Reader::whole_number(std::string_view& rest, const char* what, std::int64_t least,
                                           std::int64_t most, std::int64_t& value) const {
  const std::string_view word = next_word(rest);
  if (!parse_integer(word, value)) return wrong(std::string(what) + " was expected, found " + in_quotes(word));
  if (value < least || value > most)
    return wrong(std::string(what) + " " + std::to_string(value) + " is not within " + std::to_string(least) + " to " +
                 std::to_string(most));
  return {};
}

Vs3Reader::Problem Vs3Reader::real_number(std::string_view& rest, const char* what, double& value) const {
  const std::string_view word = next_word(rest);
  if (!parse_number(word, value) || !std::isfinite(value) || std::abs(value) > largest_coordinate)
    return wrong(std::string(what) + " was expected, found " + in_quotes(word));
  return {};
}

Vs3Reader::Problem Vs3Reader::vertex(std::string_view rest) {
  const auto next = static_cast<std::int64_t>(vertices_.size()) + 1;
  std::int64_t number = 0;
  if (auto problem = whole_number(rest, "the number of the vertex, in sequence,", next, next, number)) return problem;
  Vec3 place;
  for (int axis = 0; axis < 3; ++axis)
    if (auto problem = real_number(rest, "a coordinate", place[axis])) return problem;
  vertices_.push_back(frame_.point_to_world(place));
  return {};
}

std::uint32_t Vs3Reader::material(const std::string& name, double reflectance) {
  for (std::uint32_t i = 0; i < scene_.materials.size(); ++i)
    if (scene_.materials[i].name == name && scene_.materials[i].reflectance.x == reflectance) return i;
  Material added;
  added.name = name;
  added.reflectance = Rgb{reflectance};
  scene_.materials.push_back(std::move(added));
  return static_cast<std::uint32_t>(scene_.materials.size() - 1);
}

/// What follows the vertices of a surface that radiates: base, combination, emittance, name.
Vs3Reader::Problem Vs3Reader::properties(std::string_view rest, FaceList::Face& face) {
  const auto before = static_cast<std::int64_t>(faces_.faces.size());
  std::int64_t base = 0, combined = 0;
  double emittance = 0;
  if (auto problem = whole_number(rest, "the number of the base surface", 0, before, base)) return problem;
  if (auto problem = whole_number(rest, "the number of a surface before, to combine with,", 0, before, combined))
    return problem;
  if (auto problem = real_number(rest, "an emittance", emittance)) return problem;
  if (combined > 0) {
    const auto counts_to = static_cast<std::uint32_t>(combined - 1);
    if (faces_.faces[counts_to].origin.counts_to != FaceList::Origin::none)
      return wrong("surface " + std::to_string(combined) + " is combined with another one itself");
    face.origin.counts_to = counts_to;
  }
  // As View3D does: no surface is quite black or quite a mirror.
  const std::string name(next_word(rest));
  face.material = material(name.empty() ? "surface" : name, 1 - std::clamp(emittance, 0.001, 0.999));
  return {};
}

Vs3Reader::Problem Vs3Reader::surface(std::string_view rest, bool only_obstructs) {
  const auto next = static_cast<std::int64_t>(faces_.faces.size()) + 1;
  std::int64_t number = 0;
  if (auto problem = whole_number(rest, "the number of the surface, in sequence,", next, next, number)) return problem;
  FaceList::Face face{static_cast<std::uint32_t>(faces_.corners.size()), 0, 0, lines_.number(), 0, false, {}};
  face.origin.only_obstructs = only_obstructs;
  const auto most = static_cast<std::int64_t>(vertices_.size());
  for (int k = 0; k < 4; ++k) {
    std::int64_t corner = 0;
    if (auto problem = whole_number(rest, "the number of a vertex", k == 3 ? 0 : 1, most, corner)) return problem;
    if (corner == 0) continue;
    faces_.corners.push_back(vertices_[static_cast<std::size_t>(corner - 1)]);
    faces_.texcoords.emplace_back(0.0);
    ++face.count;
  }
  if (only_obstructs)
    face.material = material("obstruction", 0.5);
  else if (auto problem = properties(rest, face))
    return problem;
  faces_.faces.push_back(face);
  return {};
}

Status Vs3Reader::read(ImportReport& report) {
  faces_.parts.push_back(path_);
  while (lines_.next()) {
    std::string_view rest = lines_.line();
    const std::string_view key = next_word(rest);
    if (key.empty()) continue;
    const char kind = static_cast<char>(std::toupper(static_cast<unsigned char>(key[0])));
    Problem problem;
    if (kind == 'E' || kind == '*') break;
    if (kind == 'V') problem = vertex(rest);
    if (kind == 'S' || kind == 'O') problem = surface(rest, kind == 'O');
    if (kind == 'M' || kind == 'N') problem = wrong("masks and null surfaces are not read; leave their openings out");
    if (kind == 'F')
      if (const std::string_view geometry = next_word(rest); geometry != "3" && geometry != "3D" && geometry != "3d")
        problem = wrong("the geometry " + in_quotes(geometry) + " is not read; F 3 was expected");
    if (problem) return *problem;
    if (std::string_view("VSOMNF!/TCX").find(kind) == std::string_view::npos)
      report.note("unknown keyword", at_line(path_, lines_.number()) + ": unknown keyword " + in_quotes(key) +
                                         "; such lines are passed over");
  }
  if (faces_.faces.empty()) return bad_input(path_, "has no surfaces; lines starting with S were expected");
  return Done{};
}

}  // namespace

Status read_vs3(const std::string& path, const FileFrame& frame, Scene& scene, FaceList& faces, ImportReport& report) {
  Expected<std::string> text = file_text(path, longest_file);
  if (!text) return text.error();
  return Vs3Reader(path, std::move(*text), frame, scene, faces).read(report);
}

}  // namespace lichthof::io
