/// Where other surfaces stand on a plane: the lines along which light values must not be mixed.
///
/// A wall on a floor slab cuts the slab's light in two although the slab is one polygon. Each surface that crosses a plane
/// just above it leaves a line there (its section with the plane lifted by 1 % of an element); what lies on two sides of
/// such a line has nothing to do with each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/light/raycast.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

struct ContactLine {
  Vec2 a, b;  ///< plane coordinates (m)
};

/// True when a contact line runs between the point and the centre of an element. A centre on a line (within `tolerance`)
/// counts as behind it, for its value belongs to neither side; a point on a line does not.
bool separates(const ContactLine& line, const Vec2& point, const Vec2& centre, double tolerance);

/// Does the line touch the rectangle?
bool touches(const ContactLine& line, const Vec2& lo, const Vec2& hi);

/// Lines that the surfaces near a rectangle of the plane leave in it. Glass leaves none: light passes it.
/// @param lift  height above the plane (m)
std::vector<ContactLine> contact_lines(const Scene& scene, const SurfaceBoxes& boxes, const Plane& plane,
                                       const Vec2& lo, const Vec2& hi, double lift);

}  // namespace lichthof
