/// Vocabulary without domain: vectors, colours, time. The unit of every quantity stands in this one table.
///
/// | quantity          | type            | unit                                   |
/// |-------------------|-----------------|----------------------------------------|
/// | length, position  | Vec3            | m, z up (files are converted on import) |
/// | radiance          | Rgb             | W/(m² sr)                              |
/// | radiosity, irradiance, exitance | Rgb | W/m²                                 |
/// | power             | Rgb or double   | W                                      |
/// | reflectance       | Rgb             | 1                                      |
/// | form factor       | float, double   | 1                                      |
/// | time of a machine | Instant         | ns since the start of the run          |
///
/// Rgb are three independent channels of linear sRGB.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace lichthof {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using Rgb = glm::dvec3;
using Rgbf = glm::vec3;

/// Nanoseconds on the clock of whichever driver runs the machine; machines never read a clock themselves.
struct Duration {
  std::int64_t ns = 0;
  auto operator<=>(const Duration&) const = default;
};
struct Instant {
  std::int64_t ns = 0;
  auto operator<=>(const Instant&) const = default;
};
inline Instant operator+(Instant t, Duration d) { return {t.ns + d.ns}; }
inline Duration operator-(Instant a, Instant b) { return {a.ns - b.ns}; }

/// Largest of the three channels.
inline double max_channel(const Rgb& c) { return c.x > c.y ? (c.x > c.z ? c.x : c.z) : (c.y > c.z ? c.y : c.z); }
/// Sum of the three channels: what "power" means where one number has to order shooters.
inline double sum_channels(const Rgb& c) { return c.x + c.y + c.z; }
/// CIE Y of linear sRGB (the photometric weight of a colour).
inline double luminance(const Rgb& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

inline bool all_finite(const Vec3& v) {
  return v.x - v.x == 0.0 && v.y - v.y == 0.0 && v.z - v.z == 0.0;  // inf - inf and NaN - NaN are NaN
}

}  // namespace lichthof
