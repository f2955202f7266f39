/// What reading a scene found and changed, so that a person can tell a modelling fault from a rendering one.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/base/types.hpp"

namespace lichthof::io {

struct ImportReport {
  std::string file;
  std::uint64_t faces_read = 0;
  std::uint64_t surfaces_made = 0;
  Vec3 extent{0.0};  ///< of all surfaces (m)

  std::uint64_t degenerate_dropped = 0;  ///< faces without area
  std::uint64_t duplicates_dropped = 0;  ///< faces with the corners of another one, either way round
  std::uint64_t crossing_dropped = 0;    ///< faces whose edges cross each other
  std::uint64_t nonplanar_split = 0;     ///< faces cut into triangles
  std::uint64_t concave_split = 0;       ///< faces cut into convex pieces

  std::uint64_t coplanar_overlaps = 0;  ///< pairs of faces of one plane that cover each other in part
  bool overlaps_complete = true;        ///< false: there were too many to look at all
  std::uint64_t open_edges = 0;         ///< edges with a face on one side only

  std::uint64_t emitters = 0;  ///< surfaces that emit
  Rgb power_w{0.0};            ///< Σ π Ke A (W)
  double lumens = 0;           ///< 179 lm/W on the CIE Y of it

  std::uint64_t materials = 0, textures = 0;
  std::vector<std::string> unused_materials;
  std::vector<std::string> notes;  ///< warnings; each one line, with file:line where there is one

  /// Adds a note, at most 20 of one kind; the rest is only counted.
  void note(const std::string& kind, std::string line);

  /// The report for people, one fact a line; facts that are zero and unremarkable are left out.
  std::vector<std::string> text() const;
  nlohmann::json json() const;

 private:
  struct Kind {
    std::string name;
    std::uint64_t count = 0;
  };
  std::vector<Kind> kinds_;
};

}  // namespace lichthof::io
