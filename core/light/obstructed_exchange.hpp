/// The exchange area of two polygons with obstructions between them: adaptive quadrature over one of them, exact in the other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/light/view_shaft.hpp"

namespace lichthof {

/// Two convex polygons that face each other, each in front of the other's plane, and what may stand between.
struct FacingPair {
  Polygon receiver, source;          ///< counter-clockwise seen from their fronts (m)
  Vec3 receiver_normal;              ///< unit
  std::vector<Obstruction> between;  ///< in front of both planes
};

struct Exchange {
  double area = 0;           ///< A_1 F_12 (m²)
  double error = 0;          ///< estimate of its error (m²)
  std::uint64_t points = 0;  ///< points of the receiver that were looked from
};

/// How parts of the receiver that nothing shadows are integrated.
enum class Clear : std::uint8_t {
  contour,     ///< along their edges, exactly
  quadrature,  ///< like the others: a second way to the same figure
};

/// The share of one polygon's exchange with another that obstructions leave.
///
/// The receiver falls into triangles, cut where an obstruction stands on it, for there the visible part jumps. A triangle that
/// no obstruction reaches is integrated along its edges; one from which a single obstruction hides the source is nothing; the
/// others have 19 points [Laurie82] and 6 on the border, at each of which the visible part is known exactly (PointView), and
/// are halved, the worst first, until their errors together are less than allowed. The error of one is three times the largest
/// difference of the rule of degree 8 from those of degrees 5 and 3, which share no point, or a tenth of that from a rule with
/// points on the border, which finds narrow shadows there. Of the visible and the hidden part that one is integrated whose rules
/// agree better.
/// Added to it are what the rule misses of the whole exchange, where something stands between near parts, and a point's share of
/// what is at stake where all points agree (docs/decisions/0040).
///
/// @param allowed_error  where to stop (m²)
/// @param tolerance      what is no higher over the receiver stands on it (m)
/// @param most_points    where to stop at the latest; `error` then says what was reached
/// @error  what is estimated is above the true error but for about one pair in 1000 of furnished rooms
/// @cost   25 points a triangle, a few µs each; from 50 points to `most_points`
Exchange obstructed_exchange(const FacingPair& pair, double allowed_error, double tolerance, std::uint64_t most_points,
                             Clear clear);

/// Segments along which obstructions stand on the receiver and cross its inside: how often it will be cut.
std::size_t standing_count(const FacingPair& pair, double tolerance);

}  // namespace lichthof
