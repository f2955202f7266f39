#include "core/tracing/ray_guide.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lichthof {

namespace {

/// Share of the rays that stays everywhere alike.
constexpr double floor_share = 0.3;
/// Weight of a neighbouring cell, along a side; over a corner its square.
constexpr double neighbour = 0.5;
constexpr std::uint32_t least_cells = 4, most_cells = 64;

std::uint32_t cell_of(double place, std::uint32_t cells) {
  return std::min(static_cast<std::uint32_t>(place * cells), cells - 1);
}

/// The step of a rising row of sums that a share falls into, and where in it. @returns the step
std::uint32_t step_of(std::span<const double> ends, double share, double& within) {
  const auto found = std::upper_bound(ends.begin(), ends.end(), share) - ends.begin();
  const auto step = std::min(static_cast<std::size_t>(found), ends.size() - 1);
  const double begin = step > 0 ? ends[step - 1] : 0.0;
  within = std::clamp((share - begin) / (ends[step] - begin), 0.0, 1.0 - 0x1p-40);
  return static_cast<std::uint32_t>(step);
}

}  // namespace

Vec2 square_of_direction(const Vec3& local) {
  const double radius = std::hypot(local.x, local.y);
  if (!(radius > 0)) return {0.5, 0.5};
  double a, b;
  if (std::abs(local.x) > std::abs(local.y)) {
    a = std::copysign(radius, local.x);
    b = a * std::atan(local.y / local.x) * (4 / std::numbers::pi);
  } else {
    b = std::copysign(radius, local.y);
    a = b * std::atan(local.x / local.y) * (4 / std::numbers::pi);
  }
  return {0.5 * (a + 1.0), 0.5 * (b + 1.0)};
}

RayGuide::RayGuide(std::span<const Found> found, double rays_per_cell) {
  if (found.empty()) return;
  const double wanted = static_cast<double>(found.size()) / rays_per_cell;
  cells_ = least_cells;
  while (cells_ < most_cells && 4.0 * cells_ * cells_ <= wanted) cells_ *= 2;
  std::vector<double> squares(std::size_t{cells_} * cells_, 0.0), areas(squares.size(), 0.0);
  for (const Found& one : found) {
    const std::uint32_t column = cell_of(one.square.x, cells_), row = cell_of(one.square.y, cells_);
    const double square = one.value * one.value;
    for (std::uint32_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, cells_ - 1); ++r)
      for (std::uint32_t c = column > 0 ? column - 1 : 0; c <= std::min(column + 1, cells_ - 1); ++c) {
        const double weight = one.area * (r == row ? 1.0 : neighbour) * (c == column ? 1.0 : neighbour);
        squares[r * cells_ + c] += weight * square, areas[r * cells_ + c] += weight;
      }
  }
  // Where no ray has been, take the mean.
  double all_squares = 0, all_areas = 0, sum = 0;
  for (std::size_t c = 0; c < squares.size(); ++c) all_squares += squares[c], all_areas += areas[c];
  for (std::size_t c = 0; c < squares.size(); ++c)
    sum += squares[c] = std::sqrt(areas[c] > 0 ? squares[c] / areas[c] : all_squares / all_areas);
  if (!(sum > 0)) {
    cells_ = 0;
    return;
  }
  density_.resize(squares.size()), row_end_.resize(cells_), cell_end_.resize(squares.size());
  const double per_cell = (1 - floor_share) * static_cast<double>(squares.size()) / sum;
  double rows = 0;
  for (std::uint32_t row = 0; row < cells_; ++row) {
    double along = 0;
    for (std::uint32_t c = row * cells_; c < (row + 1) * cells_; ++c)
      cell_end_[c] = along += density_[c] = floor_share + per_cell * squares[c];
    for (std::uint32_t c = row * cells_; c < (row + 1) * cells_; ++c) cell_end_[c] /= along;
    row_end_[row] = rows += along / static_cast<double>(squares.size());
  }
}

Vec2 RayGuide::warped(const Vec2& uniform, double& density) const {
  density = 1;
  if (cells_ == 0) return uniform;
  Vec2 within;
  const std::uint32_t row = step_of(row_end_, uniform.y, within.y);
  const std::span<const double> cells(cell_end_.data() + std::size_t{row} * cells_, cells_);
  const std::uint32_t column = step_of(cells, uniform.x, within.x);
  density = density_[row * cells_ + column];
  return (Vec2{column, row} + within) / static_cast<double>(cells_);
}

double RayGuide::density(const Vec2& square) const {
  return cells_ == 0 ? 1.0 : density_[cell_of(square.y, cells_) * cells_ + cell_of(square.x, cells_)];
}

}  // namespace lichthof
