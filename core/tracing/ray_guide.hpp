/// Where rays from a point should go, as the rays before them have found: a density over the square of cosine-distributed directions
/// (core/base/random, cosine_direction). A small bright thing that one ray in a hundred meets is then met by every other.
///
///     q(u) = floor + (1 - floor) · √E[f²](cell of u) / mean over the cells
///
/// f is what rays through the cell and, with less weight, through its neighbours have seen: a bright line of which one piece was
/// met is followed to both sides. The floor keeps every direction possible, so an estimate f/q stays without bias, whatever was learnt.
/// @source [Muller17], on a grid and at one point
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.hpp"

namespace lichthof {

/// Place in the square of a unit direction whose z is not negative: the inverse of cosine_direction().
Vec2 square_of_direction(const Vec3& local);

class RayGuide {
 public:
  /// What a ray has found.
  struct Found {
    Vec2 square;
    double value = 0;  ///< f ≥ 0, any unit
    double area = 0;   ///< of the square that the ray stands for: 1 / (rays · density)
  };
  /// Everywhere alike.
  RayGuide() = default;
  /// @param rays_per_cell  many where each value is noise: a cell must not follow its luckiest ray
  /// @cost 20 ns a ray, and 5 ns a cell: 64 x 64 at most
  RayGuide(std::span<const Found> found, double rays_per_cell);

  bool is_uniform() const { return cells_ == 0; }
  /// The place that a uniform one is moved to, so that they are as dense as q. Neighbours stay neighbours.
  /// @param density  q there
  Vec2 warped(const Vec2& uniform, double& density) const;
  double density(const Vec2& square) const;

 private:
  std::uint32_t cells_ = 0;       ///< along each side
  std::vector<double> density_;   ///< of each cell, row by row
  std::vector<double> row_end_;   ///< share of the rows up to and with this one
  std::vector<double> cell_end_;  ///< of a row's cells up to and with this one, of the row
};

}  // namespace lichthof
