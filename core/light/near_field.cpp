#include "core/light/near_field.hpp"

#include <algorithm>
#include <cmath>

namespace lichthof {

namespace {

// In widths of the receiver. The middle points of a plane miss or double what a small source sends, by .2 % at most from 1.75 on (the
// sum over a lattice against the integral); what a source as wide as they are sends is even over them: for it .75 is enough.
constexpr float near_height = 1.75f, even_height = 0.75f;
/// So far around the source, at most: what is left beyond is even.
constexpr float near_distance = 4.f;

/// Point k of n in the unit square, each of n equal strips along either axis with one (a Hammersley set); n a power of 2.
void net_point(std::uint32_t k, std::uint32_t n, float& x, float& y) {
  std::uint32_t reversed = 0;
  for (std::uint32_t bit = 1; bit < n; bit <<= 1) reversed = reversed << 1 | static_cast<std::uint32_t>((k & bit) != 0);
  x = (static_cast<float>(k) + 0.5f) / static_cast<float>(n);
  y = (static_cast<float>(reversed) + 0.5f) / static_cast<float>(n);
}

/// Twice the area of the triangle between the first corner and the edge to corner k (m²).
float fan_area(const FlatShooter& f, int k) {
  const float au = f.u[k - 1] - f.u[0], av = f.v[k - 1] - f.v[0], bu = f.u[k] - f.u[0], bv = f.v[k] - f.v[0];
  return au * bv - av * bu;
}

float twice_area(const FlatShooter& f) {
  float sum = 0;
  for (int k = 2; k < f.count; ++k) sum += fan_area(f, k);
  return sum;
}

bool is_parallelogram(const FlatShooter& f) {
  if (f.count != 4) return false;
  const float slack = 1e-4f * (std::abs(f.eu[0]) + std::abs(f.ev[0]) + std::abs(f.eu[1]) + std::abs(f.ev[1]));
  return std::abs(f.eu[0] + f.eu[2]) <= slack && std::abs(f.ev[0] + f.ev[2]) <= slack;
}

/// The point of a polygon for one of the unit square, alike by area (m, local).
void place_at(const FlatShooter& f, float s, float t, float& x, float& y, float& z) {
  float u, v;
  if (is_parallelogram(f)) {
    u = f.u[0] + s * f.eu[0] - t * f.eu[3], v = f.v[0] + s * f.ev[0] - t * f.ev[3];
  } else {
    float pick = s * twice_area(f);
    int k = 2;
    while (k + 1 < f.count && pick > fan_area(f, k)) pick -= fan_area(f, k++);
    const float whole = fan_area(f, k), side = whole > 0 ? std::sqrt(std::clamp(pick / whole, 0.f, 1.f)) : 0.f;
    u = f.u[0] + side * ((1 - t) * (f.u[k - 1] - f.u[0]) + t * (f.u[k] - f.u[0]));
    v = f.v[0] + side * ((1 - t) * (f.v[k - 1] - f.v[0]) + t * (f.v[k] - f.v[0]));
  }
  x = f.cx + u * f.ux + v * f.vx, y = f.cy + u * f.uy + v * f.vy, z = f.cz + u * f.uz + v * f.vz;
}

/// Of a lane over the source's plane (m).
float height_over(const FlatShooter& f, const Receivers16& r, int lane) {
  return (r.x[lane] - f.cx) * f.nx + (r.y[lane] - f.cy) * f.ny + (r.z[lane] - f.cz) * f.nz;
}

}  // namespace

std::uint32_t near_lanes_of(const Cluster& cluster, const FlatSource& source, float turned) {
  const FlatShooter& f = source.flat;
  const Receivers16& r = cluster.points;
  const float widest = source.radius + near_distance * cluster.width, p[3] = {f.cx, f.cy, f.cz};
  for (int axis = 0; axis < 3; ++axis)
    if (p[axis] < cluster.lo[axis] - widest || p[axis] > cluster.hi[axis] + widest) return 0;
  std::uint32_t near = 0;
  for (int lane = 0; lane < 16; ++lane) {
    const float width = std::sqrt(cluster.area[lane]);
    const float x = r.x[lane] - f.cx, y = r.y[lane] - f.cy, z = r.z[lane] - f.cz;
    const float turn = r.nx[lane] * f.nx + r.ny[lane] * f.ny + r.nz[lane] * f.nz;
    const bool faces = turn <= turned;
    const float height = height_over(f, r, lane);
    // Behind its plane nothing is seen of a source: of two walls back to back, with less than an element between, neither sees the other.
    const float tilt = std::sqrt(std::max(1 - turn * turn, 0.f)),
                height_there = -(x * r.nx[lane] + y * r.ny[lane] + z * r.nz[lane]);
    const bool is_in_front = height > -width * tilt && height_there > -source.radius * tilt;
    const float highest =
        std::clamp(near_height * width - 1.4f * source.radius, even_height * width, near_height * width);
    const float reach =
        source.radius + width * std::clamp(5 * std::sqrt(std::max(height, 0.f) / width), 1.f, near_distance);
    const bool is_near = x * x + y * y + z * z < reach * reach && height < highest;
    near |= (faces && is_in_front && is_near ? 1u : 0u) << lane;
  }
  return near & cluster.lanes;
}

bool is_at_gap(const FlatShooter& receiver, const FlatShooter& source) {
  constexpr float contact = 1e-3f, gap = 0.5f;  // of the receiver's extent over the source
  float lowest = 3e38f, highest = -3e38f;
  for (int k = 0; k < receiver.count; ++k) {
    const float x = receiver.x[k] - source.cx, y = receiver.y[k] - source.cy, z = receiver.z[k] - source.cz;
    const float height = x * source.nx + y * source.ny + z * source.nz;
    lowest = std::min(lowest, height), highest = std::max(highest, height);
  }
  const float extent = highest - lowest;
  return std::abs(lowest) > contact * extent && lowest < gap * extent;
}

float gap_between(const Cluster& cluster, std::uint32_t lanes, const FlatSource& source) {
  float gap = 3e38f;
  for (; lanes != 0; lanes &= lanes - 1)
    gap = std::min(gap, height_over(source.flat, cluster.points, __builtin_ctz(lanes)));
  return std::max(gap, 0.f);
}

NearPoints::NearPoints(const FlatSource& source, float gap)
    : flat_(source.flat), area_(0.5f * twice_area(source.flat)) {
  if (8 * gap < std::sqrt(area_)) packet_count_ = most_packets;
}

Receivers16 NearPoints::packet(std::uint32_t index) const {
  Receivers16 points;
  for (std::uint32_t lane = 0; lane < 16; ++lane) {
    float s, t;
    // The points of a packet are spread, too.
    net_point(lane * packet_count_ + index, 16 * packet_count_, s, t);
    place_at(flat_, s, t, points.x[lane], points.y[lane], points.z[lane]);
    points.nx[lane] = flat_.nx, points.ny[lane] = flat_.ny, points.nz[lane] = flat_.nz;
  }
  return points;
}

Aim16 places_over(const FlatShooter& polygon) {
  Aim16 aim;
  for (std::uint32_t k = 0; k < 16; ++k) {
    float s, t;
    net_point(k, 16, s, t);
    place_at(polygon, s, t, aim.x[k], aim.y[k], aim.z[k]);
    aim.x[k + 16] = aim.x[k], aim.y[k + 16] = aim.y[k], aim.z[k + 16] = aim.z[k];
  }
  return aim;
}

NearReceiver near_receiver(const Mesh& mesh, std::uint32_t element, std::uint32_t patch, const Vec3& origin) {
  const Plane& plane = mesh.planes[mesh.patches[patch].plane.value];
  std::vector<Vec3> corners;
  for (const Vec2& corner : mesh.element_polygon(mesh.patches[patch], mesh.elements[element]))
    corners.push_back(plane.point(corner));
  NearReceiver receiver;
  receiver.outline = flat_shooter(corners, plane.normal, origin);
  receiver.aim = places_over(receiver.outline);
  return receiver;
}

}  // namespace lichthof
