/// Which polygons may stand between two others, and which hide one from the other altogether: in double precision, with
/// answers that are exact but for a tolerance. (core/light/occluders answers the same for packets of light, in single.)
#pragma once

#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/scene/polygon.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// A convex polygon that may stand in the way; both its sides are opaque.
struct Obstruction {
  Polygon corners;    ///< counter-clockwise about `normal` (m)
  Vec3 normal;        ///< unit
  double offset = 0;  ///< dot(normal, p) of its plane (m)
  Box box;
  double height(const Vec3& p) const { return glm::dot(normal, p) - offset; }
};

/// @param normal  unit
Obstruction obstruction(Polygon corners, const Vec3& normal);

/// The convex hull of two convex polygons, each in front of the other's plane: every line of sight between them is in it.
class ViewShaft {
 public:
  /// @param tolerance  what reaches no deeper into the shaft counts as outside (m)
  ViewShaft(std::span<const Vec3> first, std::span<const Vec3> second, double tolerance);

  /// False only when the polygon hides nothing of the one from the other, but for the tolerance.
  /// @pre it lies in front of both polygons' planes
  bool may_hold(const Obstruction& obstruction) const;

 private:
  void add_planes(std::span<const Vec3> edges, std::span<const Vec3> points);
  struct Side {
    Vec3 normal;  ///< unit, out of the shaft
    double offset;
  };
  std::span<const Vec3> first_, second_;
  double tolerance_;
  Box box_;
  std::vector<Side> sides_;  ///< those that hold an edge of one polygon and a corner of the other
};

/// True when no point of `first` sees any point of `second`: the obstruction is convex, so its corners' lines of sight
/// decide. False where rounding leaves a doubt.
/// @pre the obstruction lies in front of both polygons' planes
bool hides_all(const Obstruction& obstruction, std::span<const Vec3> first, std::span<const Vec3> second,
               double tolerance);

}  // namespace lichthof
