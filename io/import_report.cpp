#include "io/import_report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t notes_of_a_kind = 20;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string counted(std::uint64_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace

void ImportReport::note(const std::string& kind, std::string line) {
  auto known = std::find_if(kinds_.begin(), kinds_.end(), [&](const Kind& k) { return k.name == kind; });
  if (known == kinds_.end()) known = kinds_.insert(kinds_.end(), Kind{kind, 0});
  if (++known->count <= notes_of_a_kind) notes.push_back(std::move(line));
}

std::vector<std::string> ImportReport::text() const {
  std::vector<std::string> lines;
  lines.push_back(file + ": " + counted(faces_read, "face") + ", " + counted(surfaces_made, "surface") + ", " +
                  counted(materials, "material") + ", " + counted(textures, "texture"));
  lines.push_back("extent " + number(extent.x) + " x " + number(extent.y) + " x " + number(extent.z) + " m");
  if (emitters == 0) lines.push_back("no surface emits light");
  if (emitters > 0)
    lines.push_back(counted(emitters, "emitting surface") + ", " + number(power_w.x) + " " + number(power_w.y) + " " +
                    number(power_w.z) + " W, " + number(lumens) + " lm");
  const auto fact = [&lines](std::uint64_t count, const char* what, const char* done) {
    if (count > 0) lines.push_back(counted(count, what) + " " + done);
  };
  fact(degenerate_dropped, "face", "without area dropped");
  fact(duplicates_dropped, "duplicate face", "dropped");
  fact(crossing_dropped, "face", "with crossing edges dropped");
  fact(nonplanar_split, "bent face", "cut into triangles");
  fact(concave_split, "concave face", "cut into convex pieces");
  if (coplanar_overlaps > 0)
    lines.push_back((overlaps_complete ? "" : "at least ") + counted(coplanar_overlaps, "pair") +
                    " of overlapping coplanar faces");
  else if (!overlaps_complete)
    lines.push_back("overlapping coplanar faces: not all could be looked for");
  fact(open_edges, "edge", "with a face on one side only");
  if (!unused_materials.empty()) {
    std::string names;
    for (std::size_t i = 0; i < unused_materials.size() && i < 8; ++i)
      names += (i ? ", " : "") + printable(unused_materials[i]);
    lines.push_back(counted(unused_materials.size(), "material") + " without use: " + names +
                    (unused_materials.size() > 8 ? ", ..." : ""));
  }
  for (const std::string& line : notes) lines.push_back("warning: " + line);
  for (const Kind& kind : kinds_)
    if (kind.count > notes_of_a_kind)
      lines.push_back("warning: " + std::to_string(kind.count - notes_of_a_kind) + " more of the kind '" + kind.name +
                      "'");
  return lines;
}

nlohmann::json ImportReport::json() const {
  // JSON is UTF-8; names out of files need not be.
  std::vector<std::string> unused, warnings;
  for (const std::string& name : unused_materials) unused.push_back(printable(name));
  for (const std::string& line : notes) warnings.push_back(printable(line));
  return {{"file", printable(file)},
          {"faces_read", faces_read},
          {"surfaces_made", surfaces_made},
          {"extent_m", {extent.x, extent.y, extent.z}},
          {"degenerate_dropped", degenerate_dropped},
          {"duplicates_dropped", duplicates_dropped},
          {"crossing_dropped", crossing_dropped},
          {"nonplanar_split", nonplanar_split},
          {"concave_split", concave_split},
          {"coplanar_overlaps", coplanar_overlaps},
          {"overlaps_complete", overlaps_complete},
          {"open_edges", open_edges},
          {"emitters", emitters},
          {"power_w", {power_w.x, power_w.y, power_w.z}},
          {"lumens", lumens},
          {"materials", materials},
          {"textures", textures},
          {"unused_materials", unused},
          {"warnings", warnings}};
}

}  // namespace lichthof::io
