/// The text of an OBJ file as arrays: every line checked, every message with its line.
///
/// Read by ourselves and not by tinyobjloader, which gives no lines, cuts polygons at 255 corners, rounds coordinates and
/// takes indices on trust. Materials still go through it (mtl_reader).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/types.hpp"

namespace lichthof::io {

struct ObjText {
  static constexpr std::uint32_t none = 0xffffffffu;

  struct Corner {
    std::uint32_t vertex = 0, texcoord = none;  ///< from 0
  };
  struct Face {
    std::uint32_t first = 0, count = 0;  ///< range of corners, count ≥ 3
    std::uint32_t material = none;       ///< index into materials
    std::uint32_t line = 0;
    std::uint32_t group = none;  ///< index into groups
  };
  struct Name {
    std::string text;
    std::uint32_t line = 0;
  };

  std::vector<Vec3> vertices;  ///< as in the file, finite, at most 1e9 in size
  std::vector<Vec2> texcoords;
  std::vector<Corner> corners;
  std::vector<Face> faces;
  std::vector<Name> materials;       ///< names after usemtl, each once, with the line of its first use
  std::vector<Name> groups;          ///< names after o and g, each once, with the line of its first use
  std::vector<Name> libraries;       ///< what stands after each mtllib
  Name first_unknown;                ///< a line whose keyword is not one of OBJ's; empty: none
  std::uint64_t ignored_curves = 0;  ///< lines, points and free-form elements, which have no area
};

/// Indices may be negative (counted back from the line) or point ahead; normals are checked and dropped, since every
/// polygon has its own.
/// @error bad_input: unreadable, no text, bad syntax, NaN or infinite vertex, index out of range, < 3 corners, no faces
/// @cost about 10 M lines a second; memory in proportion to the file, which may have 2 GiB
Expected<ObjText> read_obj_text(const std::string& path);

}  // namespace lichthof::io
