#include "core/light/polygon_scan.hpp"

#include "core/base/check.hpp"

namespace lichthof {
namespace {

/// A pixel centre this near to the outline counts as inside (rad; in rows and columns for the bounds): far less than
/// anyone can see, but more than the arithmetic below moves an edge.
constexpr double tolerance_rad = 1e-11;
constexpr double tolerance_px = 1e-9;

/// Rounding of a coordinate, with some reserve. It turns short edges, next to a T-junction for instance, and an edge
/// turned inwards would cut off a strip along its longer neighbour: each edge gets the room that its own corners need.
constexpr double rounding = 1e-15;

/// Polygons not higher than this over the base plane, relative to their reach, lie in it. Surfaces are planar within
/// 1e-6 of their size: without this the shooter's own surface might rise before its centre and hide everything.
constexpr double plane_tolerance = 4e-6;

/// On which side of the six planes between neighbouring faces a local point lies, one bit each.
enum Side : std::uint32_t {
  x_over_z = 1,
  x_over_minus_z = 2,
  y_over_z = 4,
  y_over_minus_z = 8,
  x_over_y = 16,
  x_over_minus_y = 32
};

std::uint32_t sides_of(const Vec3& p) {
  return (p.x > p.z ? x_over_z : 0u) | (p.x > -p.z ? x_over_minus_z : 0u) | (p.y > p.z ? y_over_z : 0u) |
         (p.y > -p.z ? y_over_minus_z : 0u) | (p.x > p.y ? x_over_y : 0u) | (p.x > -p.y ? x_over_minus_y : 0u);
}

/// The pyramid of a face: bits a direction in it has, and bits it has not.
struct Pyramid {
  std::uint32_t set, clear;
};
constexpr std::array<Pyramid, face_count> pyramids{{
    {x_over_minus_z | y_over_minus_z, x_over_z | y_over_z},
    {x_over_z | x_over_y | x_over_minus_y, 0},
    {y_over_z | x_over_minus_y, x_over_y},
    {0, x_over_minus_z | x_over_y | x_over_minus_y},
    {x_over_y, y_over_minus_z | x_over_minus_y},
}};

double largest(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

bool PolygonScan::set_polygon(const HemicubeFrame& frame, std::span<const Vec3> corners) {
  MUST(corners.size() >= 3 && corners.size() <= max_corners);
  count_ = corners.size();
  edges_state_ = Edges::unknown;
  // Half of a scene lies behind the base plane: look at the heights alone first.
  double highest = -1.0;
  for (std::size_t i = 0; i < count_; ++i) {
    corners_[i] = corners[i] - frame.centre;
    highest = std::max(highest, glm::dot(corners_[i], frame.normal));
  }
  if (!(highest > 0.0)) return false;
  sides_all_ = ~0u, sides_any_ = 0, reach_ = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    corners_[i] = frame.to_local(corners_[i]);
    const std::uint32_t sides = sides_of(corners_[i]);
    sides_all_ &= sides, sides_any_ |= sides;
    reach_ = std::max(reach_, largest(corners_[i]));
  }
  origin_ = largest(frame.centre);
  return highest > plane_tolerance * reach_ + 10 * rounding * origin_;
}

bool PolygonScan::set_face(std::uint32_t face, std::uint32_t resolution) {
  const Pyramid& pyramid = pyramids[face];
  if ((sides_any_ & pyramid.set) != pyramid.set || (sides_all_ & pyramid.clear) != 0) return false;
  const double half = 0.5 * resolution;
  first_row_ = 0, end_row_ = static_cast<std::int32_t>(face_rows(face, resolution)), last_column_ = resolution - 1.0;
  bool in_front = true;  // of the face: all corners at w > 0
  for (std::size_t i = 0; i < count_ && in_front; ++i)
    in_front = face_coordinates(face, corners_[i]).z > 1e-12 * reach_;
  if (in_front && !bound_by_corners(face, half)) return false;
  if (edges_state_ == Edges::unknown) edges_state_ = set_edges() ? Edges::known : Edges::none;
  if (edges_state_ == Edges::none || (!in_front && !bound_by_edges(face, half))) return false;
  left_count_ = right_count_ = 0;
  for (std::size_t i = 0; i < count_; ++i) add_line(edges_[i], margins_[i], face, half);
  return first_row_ < end_row_;
}

/// Rows between the lowest and the highest projected corner. Most small polygons end here: they hold no pixel centre.
bool PolygonScan::bound_by_corners(std::uint32_t face, double half) {
  double a_lo = 2.0, a_hi = -2.0, b_lo = 2.0, b_hi = -2.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 p = face_coordinates(face, corners_[i]);
    const double scale = 1.0 / p.z, a = p.x * scale, b = p.y * scale;
    a_lo = std::min(a_lo, a), a_hi = std::max(a_hi, a), b_lo = std::min(b_lo, b), b_hi = std::max(b_hi, b);
  }
  const double lowest = face == 0 ? -1.0 : 0.0;
  const double column_lo = std::max((a_lo + 1.0) * half - 0.5 - tolerance_px, 0.0);
  const double column_hi = std::min((a_hi + 1.0) * half - 0.5 + tolerance_px, last_column_);
  const double row_lo = std::max((b_lo - lowest) * half - 0.5 - tolerance_px, 0.0);
  const double row_hi = std::min((b_hi - lowest) * half - 0.5 + tolerance_px, end_row_ - 1.0);
  if (std::ceil(column_lo) > column_hi || std::ceil(row_lo) > row_hi) return false;
  first_row_ = static_cast<std::int32_t>(std::ceil(row_lo));
  end_row_ = static_cast<std::int32_t>(std::floor(row_hi)) + 1;
  return true;
}

/// Rows where every edge leaves something of the face, for polygons that reach behind the face (w ≤ 0).
bool PolygonScan::bound_by_edges(std::uint32_t face, double half) {
  const double lowest = face == 0 ? -1.0 : 0.0;
  double b_lo = lowest, b_hi = 1.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 n = face_coordinates(face, edges_[i]);
    const double most = std::abs(n.x) + n.z + margins_[i];  // of n · (a, b, 1) over the columns, without the part of b
    if (std::max(n.y * lowest, n.y) + most < 0.0) return false;
    if (n.y > 0.0) b_lo = std::max(b_lo, -most / n.y);
    if (n.y < 0.0) b_hi = std::min(b_hi, -most / n.y);
  }
  if (b_lo > b_hi) return false;
  first_row_ = static_cast<std::int32_t>(std::ceil(std::max((b_lo - lowest) * half - 0.5 - tolerance_px, 0.0)));
  end_row_ = std::min(end_row_, static_cast<std::int32_t>(std::floor((b_hi - lowest) * half - 0.5 + tolerance_px)) + 1);
  return first_row_ < end_row_;
}

/// Planes through the centre and the edges. @returns false when the polygon is edge-on: it has no inside then
bool PolygonScan::set_edges() {
  Vec3 sum{0.0}, middle{0.0};
  double lengths = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3& p = corners_[i];
    const Vec3& q = corners_[i + 1 == count_ ? 0 : i + 1];
    // Equals 2 p x q, but keeps its digits for short edges. The neighbour's edge from q to p gives exactly -2 p x q.
    edges_[i] = glm::cross(p - q, p + q);
    const double length = largest(edges_[i]), from = largest(p), to = largest(q);
    margins_[i] = tolerance_rad * length + rounding * (from * to + origin_ * (from + to));
    sum += edges_[i], middle += p, lengths += length;
  }
  // The sum is 4 area · normal, so this is the volume between centre and polygon: its sign is the winding.
  const double volume = glm::dot(sum, middle);
  if (!(std::abs(volume) > 1e-15 * lengths * reach_)) return false;
  if (volume < 0.0) {
    for (std::size_t i = 0; i < count_; ++i) edges_[i] = -edges_[i];
  }
  return true;
}

/// Adds the condition n · (a, b, 1) + margin ≥ 0 as a bound of the columns, or of the rows for a line along a row.
void PolygonScan::add_line(const Vec3& plane, double margin, std::uint32_t face, double half) {
  const Vec3 n = face_coordinates(face, plane) + Vec3{0, 0, margin};
  const double lowest = face == 0 ? -1.0 : 0.0;
  if (std::abs(n.x) <= 1e-12 * std::abs(n.y)) {
    const double row = std::clamp((-n.z / n.y - lowest) * half - 0.5, -2.0, 2.0 * half + 2.0);
    if (n.y > 0.0) first_row_ = std::max(first_row_, static_cast<std::int32_t>(std::ceil(row)));
    if (n.y < 0.0) end_row_ = std::min(end_row_, static_cast<std::int32_t>(std::floor(row)) + 1);
    if (n.y == 0.0 && n.z < 0.0) end_row_ = first_row_;
    return;
  }
  const double slope = -n.y / n.x;
  const double offset = slope * (0.5 + lowest * half) + (1.0 - n.z / n.x) * half - 0.5;
  if (n.x > 0.0) {
    left_[left_count_++] = {slope, offset};
  } else {
    right_[right_count_++] = {slope, offset};
  }
}

}  // namespace lichthof
