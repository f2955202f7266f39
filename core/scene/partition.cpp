#include "core/scene/partition.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "core/base/check.hpp"

namespace lichthof {

// ---- CellGrid ---------------------------------------------------------------------------------------------------------

CellGrid::CellGrid(const Box& bounds, std::array<std::vector<double>, 3> lines,
                   std::array<std::vector<std::uint32_t>, 3> cuts)
    : bounds_(bounds), cuts_(std::move(cuts)) {
  for (int axis = 0; axis < 3; ++axis) {
    edges_[axis].push_back(bounds.lo[axis]);
    for (const std::uint32_t cut : cuts_[axis]) {
      MUST(cut >= 1 && cut + 1 < lines[axis].size());
      edges_[axis].push_back(lines[axis][cut]);
    }
    edges_[axis].push_back(bounds.hi[axis]);
    for (std::size_t k = 1; k < edges_[axis].size(); ++k) MUST(edges_[axis][k - 1] < edges_[axis][k]);
    size_[axis] = static_cast<std::uint32_t>(cuts_[axis].size()) + 1;
  }
  MUST(std::uint64_t{size_[0]} * size_[1] * size_[2] <= max_cells);
}

namespace {
std::array<std::vector<double>, 3> lines_around(const Box& bounds,
                                                const std::array<std::vector<double>, 3>& boundaries) {
  std::array<std::vector<double>, 3> lines;
  for (int axis = 0; axis < 3; ++axis) {
    lines[axis].push_back(bounds.lo[axis]);
    lines[axis].insert(lines[axis].end(), boundaries[axis].begin(), boundaries[axis].end());
    lines[axis].push_back(bounds.hi[axis]);
  }
  return lines;
}

std::array<std::vector<std::uint32_t>, 3> every_line(const std::array<std::vector<double>, 3>& boundaries) {
  std::array<std::vector<std::uint32_t>, 3> cuts;
  for (int axis = 0; axis < 3; ++axis)
    for (std::uint32_t k = 1; k <= boundaries[axis].size(); ++k) cuts[axis].push_back(k);
  return cuts;
}
}  // namespace

CellGrid::CellGrid(const Box& bounds, const std::array<std::vector<double>, 3>& boundaries)
    : CellGrid(bounds, lines_around(bounds, boundaries), every_line(boundaries)) {}

std::uint32_t CellGrid::dimensions() const {
  return static_cast<std::uint32_t>(std::count_if(size_.begin(), size_.end(), [](std::uint32_t n) { return n > 1; }));
}

CellPosition CellGrid::position(CellId cell) const {
  MUST(cell.value < cell_count());
  return {cell.value % size_[0], cell.value / size_[0] % size_[1], cell.value / (size_[0] * size_[1])};
}

CellId CellGrid::at(const CellPosition& p) const {
  MUST(p[0] < size_[0] && p[1] < size_[1] && p[2] < size_[2]);
  return {p[0] + size_[0] * (p[1] + size_[1] * p[2])};
}

Box CellGrid::box(CellId cell) const {
  const CellPosition p = position(cell);
  return box(p, p);
}

Box CellGrid::box(const CellPosition& lo, const CellPosition& hi) const {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = edges_[axis][lo[axis]];
    box.hi[axis] = edges_[axis][hi[axis] + 1];
  }
  return box;
}

CellId CellGrid::cell_of(const std::array<std::uint16_t, 3>& block) const {
  CellPosition p{};
  for (int axis = 0; axis < 3; ++axis)
    p[axis] = static_cast<std::uint32_t>(std::upper_bound(cuts_[axis].begin(), cuts_[axis].end(), block[axis]) -
                                         cuts_[axis].begin());
  return at(p);
}

CellId CellGrid::cell_of(const Vec3& point) const {
  CellPosition p{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = edges_[axis].begin() + 1, last = edges_[axis].end() - 1;
    p[axis] = static_cast<std::uint32_t>(std::upper_bound(first, last, point[axis]) - first);
  }
  return at(p);
}

// ---- What the user asks for -------------------------------------------------------------------------------------------

Expected<CellsWanted> cells_wanted(std::string_view text) {
  const auto wrong = [&](const std::string& why) {
    return Error{
        ErrorCode::bad_input, "--cells",
        "'" + std::string(text.substr(0, 40)) + "' " + why + "; expected a count (8), NxM (4x2) or NxMxK (4x2x2)"};
  };
  CellPosition along{1, 1, 1};
  std::uint32_t parts = 0;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (true) {
    if (parts == 3) return wrong("has more than three factors");
    const auto [next, status] = std::from_chars(at, end, along[parts]);
    if (status != std::errc{}) return wrong("is not a number of cells");
    if (along[parts] == 0) return wrong("asks for no cell at all");
    if (along[parts] > max_cells) return wrong("asks for more than " + std::to_string(max_cells) + " cells");
    ++parts;
    if (next == end) break;
    if (*next != 'x' && *next != 'X') return wrong("is not a number of cells");
    at = next + 1;
  }
  const std::uint64_t count = std::uint64_t{along[0]} * along[1] * along[2];
  if (count > max_cells) return wrong("asks for more than " + std::to_string(max_cells) + " cells");
  CellsWanted wanted{static_cast<std::uint32_t>(count), std::nullopt};
  if (parts > 1) wanted.along = along;
  return wanted;
}

// ---- Choosing the cuts ------------------------------------------------------------------------------------------------

namespace {

using Cuts = std::array<std::vector<std::uint32_t>, 3>;

/// Patches in any box of blocks in constant time: three-dimensional prefix sums.
class BlockCounts {
 public:
  explicit BlockCounts(const Mesh& mesh) {
    for (int axis = 0; axis < 3; ++axis) blocks_[axis] = static_cast<std::uint32_t>(mesh.lines[axis].size()) - 1;
    sums_.assign(std::size_t{blocks_[0] + 1} * (blocks_[1] + 1) * (blocks_[2] + 1), 0);
    for (std::size_t g = 0; g < mesh.groups.size(); ++g)
      if (mesh.group_is_lit.empty() || mesh.group_is_lit[g]) {
        const Group& group = mesh.groups[g];
        sums_[index(group.block[0] + 1u, group.block[1] + 1u, group.block[2] + 1u)] += group.patch_count;
      }
    for (std::uint32_t z = 1; z <= blocks_[2]; ++z)
      for (std::uint32_t y = 1; y <= blocks_[1]; ++y)
        for (std::uint32_t x = 1; x <= blocks_[0]; ++x)
          sums_[index(x, y, z)] += sums_[index(x - 1, y, z)] + sums_[index(x, y - 1, z)] + sums_[index(x, y, z - 1)] -
                                   sums_[index(x - 1, y - 1, z)] - sums_[index(x - 1, y, z - 1)] -
                                   sums_[index(x, y - 1, z - 1)] + sums_[index(x - 1, y - 1, z - 1)];
  }

  std::uint32_t blocks(int axis) const { return blocks_[axis]; }
  std::int64_t total() const { return sums_.back(); }
  /// Patches in the blocks [lo, hi) of each axis.
  std::int64_t within(const std::array<std::uint32_t, 3>& lo, const std::array<std::uint32_t, 3>& hi) const {
    const auto at = [&](int x, int y, int z) {
      return sums_[index(x ? hi[0] : lo[0], y ? hi[1] : lo[1], z ? hi[2] : lo[2])];
    };
    return at(1, 1, 1) - at(0, 1, 1) - at(1, 0, 1) - at(1, 1, 0) + at(0, 0, 1) + at(0, 1, 0) + at(1, 0, 0) -
           at(0, 0, 0);
  }

 private:
  std::size_t index(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return x + std::size_t{blocks_[0] + 1} * (y + std::size_t{blocks_[1] + 1} * z);
  }
  std::array<std::uint32_t, 3> blocks_{};
  std::vector<std::int64_t> sums_;
};

/// How even a choice of cuts is: the fullest cell first, then the sum of squares, which still falls where several cells
/// are equally full and one move can mend only one of them.
struct Balance {
  std::int64_t fullest = 0;
  double squares = 0;
  auto operator<=>(const Balance&) const = default;
};

Balance balance_of(const BlockCounts& counts, const Cuts& cuts) {
  const auto ends = [&](int axis, std::size_t k) {
    const std::uint32_t lo = k == 0 ? 0 : cuts[axis][k - 1];
    return std::pair{lo, k == cuts[axis].size() ? counts.blocks(axis) : cuts[axis][k]};
  };
  Balance balance;
  for (std::size_t z = 0; z <= cuts[2].size(); ++z)
    for (std::size_t y = 0; y <= cuts[1].size(); ++y)
      for (std::size_t x = 0; x <= cuts[0].size(); ++x) {
        const auto [x0, x1] = ends(0, x);
        const auto [y0, y1] = ends(1, y);
        const auto [z0, z1] = ends(2, z);
        const std::int64_t n = counts.within({x0, y0, z0}, {x1, y1, z1});
        balance.fullest = std::max(balance.fullest, n);
        balance.squares += static_cast<double>(n) * static_cast<double>(n);
      }
  return balance;
}

/// Cuts of one axis at the quantiles of its marginal count, each cell at least one block wide.
std::vector<std::uint32_t> quantile_cuts(const BlockCounts& counts, int axis, std::uint32_t cells) {
  std::vector<std::uint32_t> cuts;
  const std::uint32_t blocks = counts.blocks(axis);
  std::array<std::uint32_t, 3> lo{}, hi{counts.blocks(0), counts.blocks(1), counts.blocks(2)};
  const auto below = [&](std::uint32_t cut) {
    hi[axis] = cut;
    return static_cast<double>(counts.within(lo, hi));
  };
  for (std::uint32_t k = 1; k < cells; ++k) {
    const double goal = static_cast<double>(counts.total()) * k / cells;
    const std::uint32_t lowest = cuts.empty() ? 1 : cuts.back() + 1, highest = blocks - (cells - k);
    std::uint32_t best = lowest;
    for (std::uint32_t cut = lowest; cut <= highest; ++cut)
      if (std::abs(below(cut) - goal) < std::abs(below(best) - goal)) best = cut;
    cuts.push_back(best);
  }
  return cuts;
}

/// Moves one cut at a time to the place between its neighbours that balances best, until no move helps.
Balance improve(const BlockCounts& counts, Cuts& cuts) {
  constexpr std::uint32_t reach = 4;  // blocks a cut may move at once; farther goals are reached in several rounds
  Balance best = balance_of(counts, cuts);
  for (bool moved = true; moved;) {
    moved = false;
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t k = 0; k < cuts[axis].size(); ++k) {
        const std::uint32_t from = cuts[axis][k];
        const std::uint32_t lowest = std::max(k == 0 ? 1 : cuts[axis][k - 1] + 1, from > reach ? from - reach : 1);
        const std::uint32_t highest =
            std::min(k + 1 == cuts[axis].size() ? counts.blocks(axis) - 1 : cuts[axis][k + 1] - 1, from + reach);
        std::uint32_t chosen = from;
        for (std::uint32_t to = lowest; to <= highest; ++to) {
          cuts[axis][k] = to;
          if (const Balance tried = balance_of(counts, cuts); tried < best) best = tried, chosen = to;
        }
        cuts[axis][k] = chosen;
        moved = moved || chosen != from;
      }
  }
  return best;
}

/// Area of all boundaries between cells (m²).
double boundary_area(const Vec3& size, const CellPosition& along) {
  return (along[0] - 1) * size.y * size.z + (along[1] - 1) * size.x * size.z + (along[2] - 1) * size.x * size.y;
}

struct Choice {
  Cuts cuts;
  Balance balance;
  double area = 0;
};

/// The cuts of every candidate: quantiles for all, moves only for the few that start best; the rest are dropped.
std::vector<Choice> choices_for(const BlockCounts& counts, const Vec3& size,
                                const std::vector<CellPosition>& candidates) {
  constexpr std::size_t improved = 24;
  std::vector<Choice> choices;
  for (const CellPosition& along : candidates) {
    Choice choice;
    for (int axis = 0; axis < 3; ++axis) choice.cuts[axis] = quantile_cuts(counts, axis, along[axis]);
    choice.balance = balance_of(counts, choice.cuts);
    choice.area = boundary_area(size, along);
    choices.push_back(std::move(choice));
  }
  std::stable_sort(choices.begin(), choices.end(),
                   [](const Choice& a, const Choice& b) { return a.balance < b.balance; });
  if (choices.size() > improved) choices.resize(improved);
  for (Choice& choice : choices) choice.balance = improve(counts, choice.cuts);
  return choices;
}

bool fits(const BlockCounts& counts, const CellPosition& along) {
  return along[0] <= counts.blocks(0) && along[1] <= counts.blocks(1) && along[2] <= counts.blocks(2);
}

/// Every way to write `count` as a product of three factors that the block lines allow.
std::vector<CellPosition> factorisations(std::uint32_t count, const BlockCounts& counts) {
  std::vector<CellPosition> all;
  for (std::uint32_t x = 1; x <= count; ++x) {
    if (count % x) continue;
    for (std::uint32_t y = 1; y <= count / x; ++y)
      if (count / x % y == 0)
        if (const CellPosition along{x, y, count / x / y}; fits(counts, along)) all.push_back(along);
  }
  return all;
}

Error too_few_lines(const BlockCounts& counts, const CellsWanted& wanted) {
  const auto product = [](const CellPosition& p) {
    return std::to_string(p[0]) + "x" + std::to_string(p[1]) + "x" + std::to_string(p[2]);
  };
  const std::string have = product({counts.blocks(0), counts.blocks(1), counts.blocks(2)});
  const std::string want = wanted.along ? product(*wanted.along) : std::to_string(wanted.count);
  return {ErrorCode::bad_input, "--cells",
          "the mesh has " + have + " blocks along x, y, z; they can not be divided into " + want +
              " cells. Ask for fewer cells, or for smaller patches (--patch)"};
}

}  // namespace

Expected<CellGrid> partition(const Mesh& mesh, const Box& bounds, const CellsWanted& wanted) {
  const BlockCounts counts(mesh);
  std::vector<CellPosition> candidates;
  if (!wanted.along)
    candidates = factorisations(wanted.count, counts);
  else if (fits(counts, *wanted.along))
    candidates = {*wanted.along};
  if (candidates.empty()) return too_few_lines(counts, wanted);

  // The best balance first; then, among the nearly as good ones, the shortest boundaries.
  const std::vector<Choice> choices = choices_for(counts, bounds.size(), candidates);
  std::int64_t fullest = choices.front().balance.fullest;
  for (const Choice& choice : choices) fullest = std::min(fullest, choice.balance.fullest);
  const Choice* best = nullptr;
  for (const Choice& choice : choices) {
    if (static_cast<double>(choice.balance.fullest) > 1.05 * static_cast<double>(fullest)) continue;
    if (!best || std::pair(choice.area, choice.balance) < std::pair(best->area, best->balance)) best = &choice;
  }

  // No margin around: a wall at the end of the scene has to cover the whole side of its cell.
  Box outer = bounds;
  for (int axis = 0; axis < 3; ++axis) {
    outer.lo[axis] = std::min(bounds.lo[axis], mesh.lines[axis].front());
    outer.hi[axis] = std::max(bounds.hi[axis], mesh.lines[axis].back());
  }
  return CellGrid(outer, mesh.lines, best->cuts);
}

std::vector<std::uint32_t> patch_counts(const Mesh& mesh, const CellGrid& grid) {
  std::vector<std::uint32_t> counts(grid.cell_count(), 0);
  for (std::size_t g = 0; g < mesh.groups.size(); ++g)
    if (mesh.group_is_lit.empty() || mesh.group_is_lit[g])
      counts[grid.cell_of(mesh.groups[g].block).value] += mesh.groups[g].patch_count;
  return counts;
}

std::vector<std::vector<GroupId>> groups_by_cell(const Mesh& mesh, const CellGrid& grid) {
  std::vector<std::vector<GroupId>> groups(grid.cell_count());
  for (std::uint32_t g = 0; g < mesh.groups.size(); ++g)
    groups[grid.cell_of(mesh.groups[g].block).value].push_back({g});
  return groups;
}

}  // namespace lichthof
