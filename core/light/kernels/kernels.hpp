/// The vector kernels of light transfer: 16 receivers against one shooter polygon, in three widths chosen at run time.
///
/// The same source (factor16.cpp) is compiled for x86-64-v2, AVX2 and AVX-512. No multiply-add is ever contracted and square
/// roots and divisions are exact, so all three give the same bits; only the speed differs.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/types.hpp"
#include "core/light/raycast.hpp"

namespace lichthof {

/// 16 receiver points with their unit normals, in a cell's local frame (m).
struct alignas(64) Receivers16 {
  float x[16], y[16], z[16];
  float nx[16], ny[16], nz[16];
};

/// A convex planar polygon, counter-clockwise seen from its front, in a cell's local frame (m).
struct FlatPolygon {
  static constexpr int max_corners = 20;
  int count = 0;
  float x[max_corners], y[max_corners], z[max_corners];
  float nx = 0, ny = 0, nz = 1;      ///< unit normal of the front
  float cx = 0, cy = 0, cz = 0;      ///< centre of gravity
};

/// A polygon that shoots: its corners in its own plane too, from the centre along the unit vectors u and v = n × u (m), and
/// the edges from each corner to the next.
struct FlatShooter : FlatPolygon {
  float ux = 1, uy = 0, uz = 0, vx = 0, vy = 1, vz = 0;
  float u[max_corners], v[max_corners], eu[max_corners], ev[max_corners];
};

/// An edge of a convex polygon that may stand in the way: its first corner, and its inward normal in the polygon's plane.
struct OccluderEdge {
  float x, y, z;
  float mx, my, mz, least;           ///< inside: m · p > least for all edges
};

/// The polygon, whose edges somebody else keeps.
struct FlatOccluder {
  std::span<const OccluderEdge> edges;
  float nx = 0, ny = 0, nz = 1;      ///< unit normal of the front
  float plane = 0;                   ///< n · p of its plane (m)
};

/// Where the shadow rays of 16 receivers aim: 16 points of the shooter, one a lane, so that what hides one point is not
/// lost to a whole patch. Written twice, so that any 16 in a row are a rotation.
struct Aim16 {
  float x[32], y[32], z[32];
};

/// What the kernel leaves behind: unoccluded form factors, and segments ready for the shadow rays.
struct alignas(64) Factors16 {
  float factor[16];                  ///< 0 in lanes that do not see the shooter
  LaneMask16 seen;                   ///< lanes that do
  Segments16 segments;               ///< receiver -> visible point of the shooter, both ends lifted off; clear_segments() once
};

/// Form factors of 16 receivers [Baum89], clipped to each receiver's own horizon.
///
/// @param lanes   bit i: lane i holds a receiver
/// @param aim     points of the shooter; lane i aims at point i + turn, unless its horizon cuts the polygon
/// @param turn    0..15
/// @param offset  m; lift of both segment ends off their surfaces (RayScene::offset)
/// @returns       bit i: lane i sees the shooter's front (factor > 0)
/// @error         relative to the face-to-face factor: ≤ 3e-6 up to distance/size 2, 1e-5 up to 7, 5e-5 up to 50; lanes that
///                the horizon cuts: 2.5e-4 at 50 (single precision, difference form)
/// @cost          about 2 ns per receiver with AVX-512
using Factor16 = std::uint32_t (*)(const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter,
                                   const Aim16& aim, int turn, float offset, Factors16& out);

/// Sums of three channels and 16 lanes that lose nothing to rounding: value + rest is what was added [Kahan65]. After 1e5
/// arrivals plain single precision is off by 1e-4, always towards less.
struct alignas(64) Sums16 {
  float value[3][16] = {};
  float rest[3][16] = {};
};

/// Adds factor · value to three channels of 16 lanes, where no ray was blocked (tfar of a blocked lane is negative).
/// On return `factors.factor` is 0 in blocked lanes.
/// @param area  m² per lane, or nullptr where the sum is not asked for
/// @returns     Σ area · factor over the lanes (m²), in a fixed order
using Accumulate16 = float (*)(Factors16& factors, const float* area, const float (&value)[3], Sums16& sums);

/// Tests one occluder before any ray: lanes whose segment it blocks leave `active` and get a negative tfar.
/// @returns whether lanes are left
/// @cost about 15 ns with AVX-512
using Block16 = bool (*)(const FlatOccluder& occluder, Segments16& segments, LaneMask16& active);

/// For node culling: true when every one of 8 box corners lies behind the polygon as seen from every corner of the shooter,
/// that is, one convex occluder hides the whole box.
/// @param box     8 corners x, y, z (m)
/// @param margin  m; a shooter nearer than this to the occluder's plane lies in it, and is not hidden by it
using Hidden8 = bool (*)(const float (&box)[3][8], const FlatPolygon& shooter, const FlatOccluder& occluder, float margin);

/// 16 surfaces that may stand between a shooter and receivers, for one test at a time (m, local).
struct alignas(64) Occluders16 {
  float bounds[6][16];               ///< low ends on x, y, z, then high ends
  float nx[16], ny[16], nz[16];
  float plane[16];                   ///< n · p
  std::uint32_t index[16];           ///< of the surface
};

/// The convex hull of a shooter's box and a receivers' box: every segment between the two stays inside [Haines94].
struct Shaft {
  float lo[3], hi[3];                ///< bounds of the hull
  float centre[3], half[3];          ///< of the receivers' box
  float slack = 0;                   ///< m; who is this near to a plane lies in it
  int planes = 0;
  /// A side of the hull, parallel to one axis. A box is outside when a · bounds[p] + b · bounds[q] > d: p and q pick the
  /// corner that is furthest inside.
  struct Side {
    int p, q;
    float a, b, d;
  } side[12];
};

/// Some of the occluders of a block.
struct Candidates {
  std::uint32_t block = 0, lanes = 0;
};

/// For each block: bit i: the whole shooter lies on this side of occluder i's plane, or in it.
struct ShooterSides {
  std::uint32_t above = 0, below = 0;
};

/// Which of the candidates may block a segment inside the shaft. Left out are those outside of the hull, and those with the
/// shooter and the receivers on one side of their plane: no segment crosses it.
/// @param to  room for `count`; may be `from` itself
/// @returns   how many are left
/// @cost      about 10 ns per block with AVX2
using InShaft = std::size_t (*)(const Shaft& shaft, const Occluders16* blocks, const ShooterSides* sides, const Candidates* from,
                                std::size_t count, Candidates* to);

struct Kernels {
  const char* name;                  ///< "x86-64-v2", "avx2" or "avx512"
  Factor16 factor16;
  Accumulate16 accumulate16;
  Block16 block16;
  Hidden8 hidden8;
  InShaft in_shaft;
};

/// The widest kernels this machine runs. LICHTHOF_VECTOR=x86-64-v2|avx2|avx512 in the environment asks for a narrower one.
const Kernels& kernels();

/// All kernels this machine can run, widest last: for tests and benchmarks.
std::span<const Kernels> available_kernels();

/// From world corners, relative to the local origin. @{
FlatPolygon flat_polygon(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin);
FlatShooter flat_shooter(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin);
/// @}
/// Appends the edges of an occluder. @returns it, without them: the vector may move them once more
/// @param margin  m; edges are moved out by this much, so that neighbours leave no gap between them
FlatOccluder flat_occluder(std::span<const Vec3> corners, const Vec3& normal, const Vec3& origin, double margin,
                           std::vector<OccluderEdge>& edges);

}  // namespace lichthof
