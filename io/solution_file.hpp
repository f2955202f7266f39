/// Solutions in files (`.lht`): scene, options, counters, energy and the per-element arrays, versioned, compressed and
/// checksummed. The mesh is not stored: it follows from scene, sizes and lit sides, bit for bit, and a hash proves it.
#pragma once

#include <string>

#include "core/base/expected.hpp"
#include "core/light/solution.hpp"

namespace lichthof::io {

/// Writes under a temporary name, flushes, renames: an interrupted write leaves the older file as it was.
/// @pre   scene and mesh are set; every array has one entry per element, or is empty (read back as zeros)
/// @error io
Status write_solution(const std::string& path, const Solution& solution);

/// Reads and checks a solution; whatever is wrong is one clear line. Memory stays in proportion to the file.
/// @error bad_input: no solution file, another format version, truncated, damaged, or its mesh comes out differently here
/// @cost  that of meshing again, plus reading
Expected<Solution> read_solution(const std::string& path);

/// True when the file begins like a solution, whatever its name: `probe` and `walk` take scenes and solutions.
bool is_solution_file(const std::string& path);

}  // namespace lichthof::io
