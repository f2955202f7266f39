/// Which polygons may stand between two others, and which hide one from the other altogether: in double precision, with
/// answers that are exact but for a tolerance. (core/light/occluders answers the same for packets of light, in single.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/scene/polygon.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// A convex thing that may stand in the way: a polygon, both sides of which are opaque, or a solid.
struct Obstruction {
  struct Plane {
    Vec3 normal;        ///< unit; of a solid outwards
    double offset = 0;  ///< dot(normal, p) on it (m)
    double height(const Vec3& p) const { return glm::dot(normal, p) - offset; }
  };
  struct Rim {
    Vec3 from, to;
    std::uint32_t left = 0, right = 0;  ///< the planes that meet there
  };
  Polygon corners;            ///< of a polygon counter-clockwise about its plane's normal (m)
  std::vector<Plane> planes;  ///< one: a polygon
  std::vector<Rim> rims;      ///< edges of a solid; of a polygon none: they follow from its corners
  Box box;
  bool is_solid() const { return planes.size() > 1; }
};

/// A polygon. @param normal  unit
Obstruction obstruction(Polygon corners, const Vec3& normal);

/// The sides of the pyramid in which the obstruction's shadow lies, seen from a point: unit normals of planes through the
/// point, inwards.
/// @returns false when there is no shadow: the point sees a polygon edge on, or is inside a solid
bool shadow_sides(const Obstruction& obstruction, const Vec3& point, double tolerance, std::vector<Vec3>& sides);

/// Calls visit(from, to) for every edge.
template <class Visit>
void for_each_edge(const Obstruction& obstruction, Visit visit) {
  for (const Obstruction::Rim& rim : obstruction.rims) visit(rim.from, rim.to);
  if (obstruction.is_solid()) return;
  const Polygon& corners = obstruction.corners;
  for (std::size_t k = 0; k < corners.size(); ++k) visit(corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
}

/// The convex hull of two convex polygons, each in front of the other's plane: every line of sight between them is in it.
class ViewShaft {
 public:
  /// @param tolerance  what reaches no deeper into the shaft counts as outside (m)
  ViewShaft(std::span<const Vec3> first, std::span<const Vec3> second, double tolerance);

  /// False only when the obstruction hides nothing of the one from the other, but for the tolerance.
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
/// @pre the obstruction lies in front of both polygons' planes, neither of which reaches into a solid
bool hides_all(const Obstruction& obstruction, std::span<const Vec3> first, std::span<const Vec3> second,
               double tolerance);

/// What of `second` some points of `first` may see past the obstructions: it without the part that one of them hides from all
/// of `first` (from its corners, hence from all). In convex pieces; none: nothing is seen.
/// @param which  the obstructions that count
/// @pre  as of hides_all
/// @cost some µs per obstruction and piece
std::vector<Polygon> outside_umbrae(std::span<const Obstruction> obstructions, std::span<const std::uint32_t> which,
                                    std::span<const Vec3> first, std::span<const Vec3> second, double tolerance);

}  // namespace lichthof
