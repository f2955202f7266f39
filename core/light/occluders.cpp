#include "core/light/occluders.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/footprint.hpp"

namespace lichthof {

namespace {

constexpr std::size_t block_size = 16;

/// Any convex part of a surface may answer "blocked"; only all of it may answer "free".
FlatOccluder occluder_of(const Surface& surface, const Vec3& origin, double margin) {
  const std::size_t count = surface.corners.size();
  if (count <= FlatPolygon::max_corners)
    return flat_occluder(flat_polygon(surface.corners, surface.normal, origin), margin);
  Polygon some;
  for (std::size_t k = 0; k < FlatPolygon::max_corners; ++k)
    some.push_back(surface.corners[k * count / FlatPolygon::max_corners]);
  return flat_occluder(flat_polygon(some, surface.normal, origin), margin);
}

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
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    flat_.push_back(occluder_of(surfaces[s], origin, offset));
    exact_.push_back(surfaces[s].corners.size() <= FlatPolygon::max_corners);
    boxes.push_back(box_of(surfaces[s], origin, offset));
    largest = std::max(largest, extent(boxes.back()));
    if (scene.material_of(surfaces[s]).finish != Finish::glass) order.push_back(s);
  }
  // Walls and floors meet most shafts: among small ones they would keep every block alive.
  const auto small = std::stable_partition(order.begin(), order.end(),
                                           [&](std::uint32_t s) { return extent(boxes[s]) > 0.25f * largest; });
  add_blocks({order.begin(), small}, boxes);
  add_blocks({small, order.end()}, boxes);
  add_parents();
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
    const FlatPolygon& polygon = flat_[s].polygon;
    block.nx[lane] = polygon.nx, block.ny[lane] = polygon.ny, block.nz[lane] = polygon.nz;
    block.plane[lane] = flat_[s].plane;
    block.index[lane] = s;
    block.exact |= std::uint32_t{exact_[s]} << lane;
  }
  blocks_.push_back(block);
  lanes_.push_back((1u << surfaces.size()) - 1);
}

void Occluders::add_parents() {
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::size_t lane = b % block_size;
    if (lane == 0) parents_.emplace_back();  // without planes: no side of one can rule a block out
    Occluders16& parent = parents_.back();
    for (int axis = 0; axis < 3; ++axis) {
      const float *lo = blocks_[b].bounds[axis], *hi = blocks_[b].bounds[3 + axis];
      const int count = __builtin_popcount(lanes_[b]);
      parent.bounds[axis][lane] = *std::min_element(lo, lo + count);
      parent.bounds[3 + axis][lane] = *std::max_element(hi, hi + count);
    }
  }
}

std::vector<ShooterSides> Occluders::sides_of(const FlatPolygon& shooter) const {
  std::vector<ShooterSides> sides(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Occluders16& o = blocks_[b];
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
    for (std::size_t lane = 0; lane < block_size; ++lane) {
      sides[b].above |= std::uint32_t{lowest[lane] >= -slack_} << lane;
      sides[b].below |= std::uint32_t{highest[lane] <= slack_} << lane;
    }
  }
  return sides;
}

OccluderSelection Occluders::in_shaft(const Shaft& shaft, std::span<const ShooterSides> sides, std::size_t most) const {
  OccluderSelection chosen;
  std::vector<Candidates> parents;
  for (std::uint32_t p = 0; p < parents_.size(); ++p) parents.push_back({p, 0xffff});
  const std::vector<ShooterSides> neither(parents_.size());
  parents.resize(
      kernels().in_shaft(shaft, parents_.data(), neither.data(), parents.data(), parents.size(), parents.data()));

  std::vector<Candidates> blocks;
  std::size_t count = 0;
  for (const Candidates& parent : parents) {
    const std::size_t first = blocks.size();
    for (std::uint32_t left = parent.lanes; left != 0; left &= left - 1) {
      const auto block =
          static_cast<std::uint32_t>(parent.block * block_size) + static_cast<std::uint32_t>(__builtin_ctz(left));
      if (block < blocks_.size()) blocks.push_back({block, lanes_[block]});
    }
    Candidates* const some = blocks.data() + first;
    blocks.resize(first + kernels().in_shaft(shaft, blocks_.data(), sides.data(), some, blocks.size() - first, some));
    for (std::size_t k = first; k < blocks.size(); ++k)
      count += static_cast<std::size_t>(__builtin_popcount(blocks[k].lanes));
    if (count > most) {
      chosen.complete = false;
      return chosen;
    }
  }

  count = (count + block_size - 1) / block_size;
  chosen.blocks.reserve(count), chosen.sides.reserve(count), chosen.candidates.reserve(count);
  std::uint32_t lane = block_size;
  for (const Candidates& candidates : blocks) {
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
      to.exact |= (from.exact >> k & 1) << lane;
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
  return bytes_of_all(flat_, blocks_, lanes_, parents_) + exact_.size() / 8;
}

}  // namespace lichthof
