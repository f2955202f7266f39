/// Matrices of view factors as files; the ending of the name chooses the format.
///
/// `.csv`   header `surface,area_m2,NAME...`, then one row a surface: its name, area and factors to all surfaces. Where something
///          is wrong with the figures, lines that begin with # say so at the end; what is not known is an empty cell.
/// `.json`  `{"complete", "tolerance", "pairs": {"inexact", "disagreeing", "missing"}, "surfaces": [{"name", "area_m2",
///          "row_sum"}...], "factors": [[...]...], "errors": [[...]...]}`; errors are estimates for the factor in the same
///          place; what is not known is null.
/// `.vf`    View3D's own, which others read: `View3D 3.2 0 ENCL EMIT N`, N areas, N rows of N factors, N emittances. Six digits
///          after the point where View3D writes six, here nine; what is not known is `nan`; # lines as in `.csv`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/light/view_factors.hpp"

namespace lichthof::io {

/// What a file says beside the matrix.
struct ViewFactorRecord {
  double tolerance = 0;
  std::vector<std::uint32_t> rows;  ///< those to be written; empty: all
  std::vector<double> emittances;   ///< one per row of the matrix; empty: 1 each
};

/// What is wrong with the figures, in a line each: not reached, above the tolerance, two ways that disagree.
std::vector<std::string> faults(const ViewFactors& factors, double tolerance, std::span<const std::string> names);

/// @param names  one per row of the matrix
/// @error io; bad_input: another ending. Nothing half-written stays behind
Status write_view_factors(const std::string& path, const ViewFactors& factors, std::span<const std::string> names,
                          const ViewFactorRecord& record = {});

}  // namespace lichthof::io
