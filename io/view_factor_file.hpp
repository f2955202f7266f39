/// Matrices of view factors as files; the ending of the name chooses the format.
///
/// `.csv`   header `surface,area_m2,NAME...`, then one row a surface: its name, area and factors to all surfaces.
/// `.json`  `{"surfaces": [{"name", "area_m2", "row_sum"}...], "factors": [[...]...], "errors": [[...]...]}`; errors are
///          estimates for the factor in the same place.
#pragma once

#include <span>
#include <string>

#include "core/base/expected.hpp"
#include "core/light/view_factors.hpp"

namespace lichthof::io {

/// @param names  one per row of the matrix
/// @error io; bad_input: another ending. Nothing half-written stays behind
Status write_view_factors(const std::string& path, const ViewFactors& factors, std::span<const std::string> names);

}  // namespace lichthof::io
