/// Materials of an MTL file. tinyobjloader reads the values and the texture options; what it can't do, saying which line
/// is wrong, is done by a pass over the lines before it sees them.
///
/// Finish: illum 3 with Ks is a mirror, illum 4..7 glass, Ks and Ns otherwise a glossy lobe unless illum is 0 or 1.
#pragma once

#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/scene/scene.hpp"
#include "io/import_report.hpp"

namespace lichthof::io {

/// Reflectances are brought below one by scaling to this value: a surface that loses nothing never lets the light settle.
inline constexpr double largest_reflectance = 0.999;

struct MtlMaterial {
  Material material;
  std::string texture_file;                              ///< map_Kd as written, '\' turned into '/'; empty: none
  std::uint32_t line = 0;                                ///< of its newmtl
  std::uint32_t reflectance_line = 0, texture_line = 0;  ///< of Kd (or of newmtl) and of map_Kd
};

/// @error bad_input, with file:line: unreadable, a value that is no number, NaN or negative
/// Names defined twice keep their first meaning, with a note.
Expected<std::vector<MtlMaterial>> read_mtl(const std::string& path, ImportReport& report);

/// Brings Kd and Kd + Ks of one material below one, with a note naming it and `where`.
void clamp_reflectance(Material& material, const std::string& where, ImportReport& report);

/// Whether every channel is a number ≥ 0.
bool is_valid_colour(const Rgb& colour);

}  // namespace lichthof::io
