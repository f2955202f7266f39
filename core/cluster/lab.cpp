#include "core/cluster/lab.hpp"

#include <algorithm>

namespace lichthof {

namespace {
/// Above any machine there is, and far enough below 2^64 for sums.
constexpr double most_bytes = 0x1p60;
constexpr std::uint32_t most_cells = 1u << 16;

Error bad_wish(const std::string& message) { return {ErrorCode::bad_input, "job", message}; }
}  // namespace

Status plausible(const JobWish& wish) {
  if (!wish.radiosity && !wish.picture) return bad_wish("asks for neither radiosity nor a picture");
  const double cells = double(wish.grid[0]) * wish.grid[1] * wish.grid[2];
  if (cells < 1) return bad_wish("a grid has at least one cell along each axis");
  if (cells > most_cells)
    return bad_wish("asks for " + std::to_string(static_cast<std::uint64_t>(std::min(cells, most_bytes))) +
                    " cells; a lab leads at most " + std::to_string(std::uint64_t{most_cells}));
  if (cells != double(wish.patches.size()))
    return bad_wish("the grid has " + std::to_string(static_cast<std::uint64_t>(std::min(cells, most_bytes))) +
                    " cells, patches are given for " + std::to_string(wish.patches.size()));
  double bytes = double(wish.base_bytes);
  for (const std::uint32_t patches : wish.patches) bytes += double(patches) * double(wish.bytes_per_patch);
  if (bytes > most_bytes) return bad_wish("needs more memory than any machine has");
  return Done{};
}

}  // namespace lichthof
