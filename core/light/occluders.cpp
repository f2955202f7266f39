#include "core/light/occluders.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/footprint.hpp"

namespace lichthof {

namespace {

constexpr std::size_t block_size = 16;

FlatBox box_of(const Surface& surface, const Vec3& origin, double margin) {
  Box box;
  for (const Vec3& corner : surface.corners) box.include(corner - origin);
  FlatBox flat;
  for (int axis = 0; axis < 3; ++axis) {
    flat.lo[axis] = static_cast<float>(box.lo[axis] - margin);
    flat.hi[axis] = static_cast<float>(box.hi[axis] + margin);
  }
  return flat;
}

float extent(const FlatBox& box) {
  return std::max({box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]});
}

float centre(const FlatBox& box, int axis) { return 0.5f * (box.lo[axis] + box.hi[axis]); }

}  // namespace

FlatBox box_of(const FlatPolygon& f) {
  return {{*std::min_element(f.x, f.x + f.count), *std::min_element(f.y, f.y + f.count),
           *std::min_element(f.z, f.z + f.count)},
          {*std::max_element(f.x, f.x + f.count), *std::max_element(f.y, f.y + f.count),
           *std::max_element(f.z, f.z + f.count)}};
}

Occluders::Occluders(const Scene& scene, std::span<const Surface> surfaces, const Vec3& origin, double offset)
    : slack_(static_cast<float>(0.5 * offset)) {
  std::vector<FlatBox> boxes;
  std::vector<std::uint32_t> order;
  float largest = 0;
  std::size_t edges = 0;
  for (const Surface& surface : surfaces) edges += surface.corners.size();
  boxes.reserve(surfaces.size()), order.reserve(surfaces.size()), facing_.reserve(surfaces.size());
  edges_.reserve(edges), first_edge_.reserve(surfaces.size() + 1);
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
    const FlatOccluder flat = flat_occluder(surfaces[s].corners, surfaces[s].normal, origin, offset, edges_);
    facing_.push_back({flat.nx, flat.ny, flat.nz, flat.plane});
    boxes.push_back(box_of(surfaces[s], origin, offset));
    largest = std::max(largest, extent(boxes.back()));
    if (scene.material_of(surfaces[s]).finish != Finish::glass) order.push_back(s);
  }
  first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
  // Walls and floors meet most shafts: among small ones they would keep every block alive.
  const auto small = std::stable_partition(order.begin(), order.end(),
                                           [&](std::uint32_t s) { return extent(boxes[s]) > 0.25f * largest; });
  add_blocks({order.begin(), small}, boxes);
  add_blocks({small, order.end()}, boxes);
  add_levels();
}

/// Halves along the longest side until 16 are left.
void Occluders::add_blocks(std::span<std::uint32_t> surfaces, const std::vector<FlatBox>& boxes) {
  if (surfaces.empty()) return;
  if (surfaces.size() > block_size) {
    FlatBox centres{{3e38f, 3e38f, 3e38f}, {-3e38f, -3e38f, -3e38f}};
    for (const std::uint32_t s : surfaces)
      for (int axis = 0; axis < 3; ++axis) {
        centres.lo[axis] = std::min(centres.lo[axis], centre(boxes[s], axis));
        centres.hi[axis] = std::max(centres.hi[axis], centre(boxes[s], axis));
      }
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (centres.hi[axis] - centres.lo[axis] > centres.hi[widest] - centres.lo[widest]) widest = axis;
    const std::size_t blocks = (surfaces.size() + block_size - 1) / block_size;
    const std::size_t half = (blocks + 1) / 2 * block_size;
    std::nth_element(surfaces.begin(), surfaces.begin() + static_cast<std::ptrdiff_t>(half), surfaces.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       return std::pair(centre(boxes[a], widest), a) < std::pair(centre(boxes[b], widest), b);
                     });
    add_blocks(surfaces.first(half), boxes);
    add_blocks(surfaces.subspan(half), boxes);
    return;
  }
  Occluders16 block{};
  for (std::size_t lane = 0; lane < surfaces.size(); ++lane) {
    const std::uint32_t s = surfaces[lane];
    for (int axis = 0; axis < 3; ++axis)
      block.bounds[axis][lane] = boxes[s].lo[axis], block.bounds[3 + axis][lane] = boxes[s].hi[axis];
    const Facing& f = facing_[s];
    block.nx[lane] = f.nx, block.ny[lane] = f.ny, block.nz[lane] = f.nz;
    block.plane[lane] = f.plane;
    block.index[lane] = s;
  }
  blocks_.push_back(block);
  lanes_.push_back((1u << surfaces.size()) - 1);
}

void Occluders::add_levels() {
  const std::vector<Occluders16>* below = &blocks_;
  do {
    std::vector<Occluders16> level((below->size() + block_size - 1) / block_size);
    for (std::size_t b = 0; b < below->size(); ++b) {
      Occluders16& parent = level[b / block_size];
      const int count = __builtin_popcount(levels_.empty() ? lanes_[b] : lanes_of(levels_.size() - 1, b));
      const std::size_t lane = b % block_size;
      for (int axis = 0; axis < 3; ++axis) {
        const float *lo = (*below)[b].bounds[axis], *hi = (*below)[b].bounds[3 + axis];
        parent.bounds[axis][lane] = *std::min_element(lo, lo + count);
        parent.bounds[3 + axis][lane] = *std::max_element(hi, hi + count);
      }
      const std::size_t blocks = std::size_t{1} << 4 * levels_.size();
      const Occluders16& first = blocks_[b * blocks];
      if (!lie_in_plane_of_first(
              std::span(blocks_).subspan(b * blocks).first(std::min(blocks, blocks_.size() - b * blocks))))
        continue;
      parent.nx[lane] = first.nx[0], parent.ny[lane] = first.ny[0], parent.nz[lane] = first.nz[0];
      parent.plane[lane] = first.plane[0];
    }
    first_side_.push_back(first_side_.empty() ? blocks_.size() : first_side_.back() + below->size());
    levels_.push_back(std::move(level));
    below = &levels_.back();
  } while (below->size() > 1);
}

/// Whether all occluders of some blocks lie in the plane of the first.
bool Occluders::lie_in_plane_of_first(std::span<const Occluders16> blocks) const {
  const Occluders16& first = blocks[0];
  for (const Occluders16& block : blocks) {
    const std::uint32_t lanes = lanes_[static_cast<std::size_t>(&block - blocks_.data())];
    for (std::uint32_t left = lanes; left != 0; left &= left - 1)
      for (const OccluderEdge& edge : (*this)[block.index[__builtin_ctz(left)]].edges)
        if (std::abs(first.nx[0] * edge.x + first.ny[0] * edge.y + first.nz[0] * edge.z - first.plane[0]) >
            0.25f * slack_)
          return false;
  }
  return true;
}

/// Of a node of a level, those that hold something below.
std::uint32_t Occluders::lanes_of(std::size_t level, std::size_t node) const {
  const std::size_t below = level == 0 ? blocks_.size() : levels_[level - 1].size();
  return (1u << std::min(block_size, below - node * block_size)) - 1;
}

std::vector<ShooterSides> Occluders::sides_of(const FlatPolygon& shooter) const {
  std::vector<ShooterSides> sides;
  sides.reserve(first_side_.back());
  const auto add = [&](const Occluders16& o) {
    float lowest[block_size], highest[block_size];
    std::fill_n(lowest, block_size, 3e38f);
    std::fill_n(highest, block_size, -3e38f);
    for (int k = 0; k < shooter.count; ++k)
      for (std::size_t lane = 0; lane < block_size; ++lane) {
        const float height =
            o.nx[lane] * shooter.x[k] + o.ny[lane] * shooter.y[k] + o.nz[lane] * shooter.z[k] - o.plane[lane];
        lowest[lane] = std::min(lowest[lane], height);
        highest[lane] = std::max(highest[lane], height);
      }
    ShooterSides& side = sides.emplace_back();
    for (std::size_t lane = 0; lane < block_size; ++lane) {
      side.above |= std::uint32_t{lowest[lane] >= -slack_} << lane;
      side.below |= std::uint32_t{highest[lane] <= slack_} << lane;
    }
  };
  for (const Occluders16& block : blocks_) add(block);
  for (const std::vector<Occluders16>& level : levels_)
    for (const Occluders16& node : level) {
      add(node);
      std::uint32_t planes = 0;
      for (std::size_t lane = 0; lane < block_size; ++lane)
        planes |= std::uint32_t{node.nx[lane] != 0 || node.ny[lane] != 0 || node.nz[lane] != 0} << lane;
      sides.back().above &= planes, sides.back().below &= planes;
    }
  return sides;
}

struct Occluders::Search {
  const Shaft& shaft;
  std::span<const ShooterSides> sides;
  std::size_t most;
  std::vector<Candidates> blocks{};
  std::size_t count = 0;  ///< of occluders in them
};

/// Ends early when more are found than asked for.
void Occluders::search(Search& found, std::size_t level, std::size_t node) const {
  Candidates inside{0, lanes_of(level, node)};
  if (kernels().in_shaft(found.shaft, &levels_[level][node], &found.sides[first_side_[level] + node], &inside, 1,
                         &inside) == 0)
    return;
  const std::size_t first = found.blocks.size();
  for (std::uint32_t left = inside.lanes; left != 0 && found.count <= found.most; left &= left - 1) {
    const std::size_t below = node * block_size + static_cast<std::size_t>(__builtin_ctz(left));
    if (level > 0)
      search(found, level - 1, below);
    else
      found.blocks.push_back({static_cast<std::uint32_t>(below), lanes_[below]});
  }
  if (level > 0) return;
  Candidates* const some = found.blocks.data() + first;
  found.blocks.resize(first + kernels().in_shaft(found.shaft, blocks_.data(), found.sides.data(), some,
                                                 found.blocks.size() - first, some));
  for (std::size_t k = first; k < found.blocks.size(); ++k)
    found.count += static_cast<std::size_t>(__builtin_popcount(found.blocks[k].lanes));
}

OccluderSelection Occluders::in_shaft(const Shaft& shaft, std::span<const ShooterSides> sides, std::size_t most) const {
  OccluderSelection chosen;
  Search found{shaft, sides, most};
  if (!blocks_.empty()) search(found, levels_.size() - 1, 0);
  chosen.complete = found.count <= most;
  if (!chosen.complete) return chosen;

  const std::size_t count = (found.count + block_size - 1) / block_size;
  chosen.blocks.reserve(count), chosen.sides.reserve(count), chosen.candidates.reserve(count);
  std::uint32_t lane = block_size;
  for (const Candidates& candidates : found.blocks) {
    const Occluders16& from = blocks_[candidates.block];
    for (std::uint32_t left = candidates.lanes; left != 0; left &= left - 1, ++lane) {
      if (lane == block_size) {
        chosen.candidates.push_back({static_cast<std::uint32_t>(chosen.blocks.size()), 0});
        chosen.blocks.emplace_back();
        chosen.sides.emplace_back();
        lane = 0;
      }
      const auto k = static_cast<std::uint32_t>(__builtin_ctz(left));
      Occluders16& to = chosen.blocks.back();
      for (int side = 0; side < 6; ++side) to.bounds[side][lane] = from.bounds[side][k];
      to.nx[lane] = from.nx[k], to.ny[lane] = from.ny[k], to.nz[lane] = from.nz[k];
      to.plane[lane] = from.plane[k];
      to.index[lane] = from.index[k];
      chosen.sides.back().above |= (sides[candidates.block].above >> k & 1) << lane;
      chosen.sides.back().below |= (sides[candidates.block].below >> k & 1) << lane;
      chosen.candidates.back().lanes |= 1u << lane;
    }
  }
  return chosen;
}

Shaft shaft_between(const FlatBox& shooter, const FlatBox& receivers, float offset) {
  const float margin = 2 * offset;
  Shaft shaft;
  shaft.slack = 0.5f * offset;
  float a[2][3], b[2][3];  // [0] low, [1] high corners
  for (int axis = 0; axis < 3; ++axis) {
    a[0][axis] = shooter.lo[axis] - margin, a[1][axis] = shooter.hi[axis] + margin;
    b[0][axis] = receivers.lo[axis] - margin, b[1][axis] = receivers.hi[axis] + margin;
    shaft.lo[axis] = std::min(a[0][axis], b[0][axis]);
    shaft.hi[axis] = std::max(a[1][axis], b[1][axis]);
    shaft.centre[axis] = 0.5f * (receivers.lo[axis] + receivers.hi[axis]);
    shaft.half[axis] = 0.5f * (receivers.hi[axis] - receivers.lo[axis]);
  }
  // Seen along an axis both boxes are rectangles; where one is further out on one axis and further in on the other, the line
  // between their corners is a side of the hull.
  for (int i = 0; i < 3; ++i)
    for (int j = i + 1; j < 3; ++j)
      for (int corner = 0; corner < 4; ++corner) {
        const int high_i = corner & 1, high_j = corner >> 1;
        const float out_i = high_i ? 1.f : -1.f, out_j = high_j ? 1.f : -1.f;
        const float di = (a[high_i][i] - b[high_i][i]) * out_i, dj = (a[high_j][j] - b[high_j][j]) * out_j;
        if (!(di * dj < 0)) continue;
        Shaft::Side& side = shaft.side[shaft.planes++];
        side.p = high_i ? i : 3 + i, side.q = high_j ? j : 3 + j;
        side.a = out_i * std::abs(dj), side.b = out_j * std::abs(di);
        side.d = std::max(side.a * a[high_i][i] + side.b * a[high_j][j], side.a * b[high_i][i] + side.b * b[high_j][j]);
      }
  return shaft;
}

std::size_t Occluders::memory_bytes() const {
  std::size_t bytes = bytes_of_all(facing_, edges_, first_edge_, blocks_, lanes_);
  for (const std::vector<Occluders16>& level : levels_) bytes += bytes_of(level);
  return bytes;
}

}  // namespace lichthof
