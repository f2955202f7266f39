// Compiled once per vector width: LICHTHOF_WIDTH names the namespace, LICHTHOF_LANES the floats in a register.
// See kernels.hpp.
#include <immintrin.h>

#include <cmath>

#include "core/light/kernels/kernels.hpp"

namespace lichthof::LICHTHOF_WIDTH {

namespace {

constexpr int lanes_at_once = LICHTHOF_LANES;
using V = float __attribute__((vector_size(4 * lanes_at_once)));
using M = std::int32_t __attribute__((vector_size(4 * lanes_at_once)));

struct V3 {
  V x, y, z;
};

inline V load(const float* p) { return *reinterpret_cast<const V*>(p); }
inline V load_any(const float* p) {  // unaligned
  V v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, V v) { *reinterpret_cast<V*>(p) = v; }
inline V all(float s) { return V{} + s; }
inline V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator*(const V& s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline V dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3 cross(const V3& a, const V3& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline V select(M m, V a, V b) { return m ? a : b; }
inline V3 select(M m, const V3& a, const V3& b) { return {m ? a.x : b.x, m ? a.y : b.y, m ? a.z : b.z}; }

// One instruction each; the compiler makes compare and blend of the portable form. The second of two equal values counts.
#if LICHTHOF_LANES == 4
inline V least(V a, V b) { return reinterpret_cast<V>(_mm_min_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b))); }
inline V most(V a, V b) { return reinterpret_cast<V>(_mm_max_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b))); }
#elif LICHTHOF_LANES == 8
inline V least(V a, V b) { return reinterpret_cast<V>(_mm256_min_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b))); }
inline V most(V a, V b) { return reinterpret_cast<V>(_mm256_max_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b))); }
#else  // the headers of g++ 12 warn falsely of these two intrinsics
inline V least(V a, V b) { return a < b ? a : b; }
inline V most(V a, V b) { return a > b ? a : b; }
#endif
inline V absolute(V v) { return reinterpret_cast<V>(reinterpret_cast<M>(v) & 0x7fffffff); }

inline V square_root(V v) {
  V r;
  for (int i = 0; i < lanes_at_once; ++i) r[i] = std::sqrt(v[i]);
  return r;
}

#if LICHTHOF_LANES == 4
constexpr M bit_of_lane{1, 2, 4, 8};
#elif LICHTHOF_LANES == 8
constexpr M bit_of_lane{1, 2, 4, 8, 16, 32, 64, 128};
#else
constexpr M bit_of_lane{1,   2,   4,    8,    16,   32,   64,    128,
                        256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
#endif
inline M lane_mask(std::uint32_t bits) { return (bit_of_lane & static_cast<std::int32_t>(bits)) != 0; }
inline std::uint32_t bits_of(M m) {
#if defined(__AVX512F__)
  return static_cast<std::uint32_t>(_mm512_movepi32_mask(reinterpret_cast<__m512i>(m)));
#elif defined(__AVX2__)
  return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(m)));
#else
  return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(m)));
#endif
}
inline bool any(M m) { return bits_of(m) != 0; }

/// θ/sinθ as a function of c = cosθ in [0, 1]: Chebyshev fit of degree 9, error 1.7e-8. Summed in pairs of pairs: half as
/// long a chain of dependent operations as Horner's.
inline V theta_over_sine(V c) {
  const V y = c * 2.f - 1.f;
  const V y2 = y * y, y4 = y2 * y2;
  const V p01 = 1.2091995900717911f + y * -0.26360016626526517f, p23 = 0.06973250427637592f + y * -0.019836653439004072f,
          p45 = 0.005867037097824852f + y * -0.00177564106674307f, p67 = 0.0005300576221218733f + y * -0.00016329768749869802f,
          p89 = 6.895964119280507e-05f + y * -2.240252905210127e-05f;
  return (p01 + y2 * p23) + y4 * ((p45 + y2 * p67) + y4 * p89);
}

/// One edge of Lambert's sum, times 2π: angle(a, b) · n · unit(b × a), from the edge e = b - a (difference form).
inline V edge_term(const V3& n, const V3& a, const V3& b, const V3& e, V inverse_a, V inverse_b) {
  const V scale = inverse_a * inverse_b;
  const V cosine = dot(a, b) * scale;
  const V3 across = cross(e, a);
  const M obtuse = cosine < 0.f;
  V ratio = theta_over_sine(least(all(1.f), absolute(cosine)));
  if (any(obtuse)) {
    // Beyond a right angle sinθ must come from the cross product: sqrt(1 - cos²) cancels near θ = π.
    const V sine = square_root(dot(across, across)) * scale;
    const V safe = select(sine > 1e-12f, sine, all(1e-12f));
    ratio = select(obtuse, 3.14159265358979f / safe - ratio, ratio);
  }
  return ratio * dot(n, across) * scale;
}

inline V inverse_length(const V3& a) {
  const V square = dot(a, a);
  return 1.f / square_root(square + 1e-37f);  // a corner at the receiver itself contributes nothing: a is 0 there
}

/// A shooter with its edges. They are the same for all lanes, and have no rounding of the receivers' places.
struct Outline {
  explicit Outline(const FlatShooter& s) : shooter(s) {
    for (int k = 0; k < s.count; ++k) {
      const int next = k + 1 == s.count ? 0 : k + 1;
      ex[k] = s.x[next] - s.x[k], ey[k] = s.y[next] - s.y[k], ez[k] = s.z[next] - s.z[k];
    }
  }
  V3 edge(int k) const { return {all(ex[k]), all(ey[k]), all(ez[k])}; }

  const FlatShooter& shooter;
  float ex[FlatShooter::max_corners], ey[FlatShooter::max_corners], ez[FlatShooter::max_corners];
};

/// The general case: some lanes see the polygon across their horizon. Every lane clips for itself; a convex polygon
/// leaves the upper half space at most once and comes back at most once, so one closing edge along the horizon suffices.
/// Lanes whose horizon cuts nothing get the very bits of the simple case: which lanes share a register is a matter of width.
V clipped_sum(const V3& n, const Outline& outline, const V3* corner, const V* height, M cut_lanes, int count, V3& target) {
  V sum = all(0.f), corners_seen = all(0.f);
  V3 leaves{sum, sum, sum}, enters{sum, sum, sum}, middle{sum, sum, sum};
  M crosses = sum > 1.f;
  for (int k = 0; k < count; ++k) {
    const int next = k + 1 == count ? 0 : k + 1;
    const V3 &a = corner[k], &b = corner[next];
    const V ha = height[k], hb = height[next];
    const M a_in = (ha > 0.f) | ~cut_lanes, b_in = (hb > 0.f) | ~cut_lanes;
    const M out = a_in & ~b_in, in = ~a_in & b_in, used = a_in | b_in;
    if (!any(used)) continue;
    const V span = ha - hb;
    const V t = ha / select(out | in, span, all(1.f));
    const V3 cut = a + t * (b - a);
    const V3 from = select(in, cut, a), to = select(out, cut, b);
    const V3 edge = select(a_in & b_in, outline.edge(k), to - from);
    const V term = edge_term(n, from, to, edge, inverse_length(from), inverse_length(to));
    sum += select(used, term, all(0.f));
    leaves = select(out, cut, leaves);
    enters = select(in, cut, enters);
    crosses = crosses | out;
    const V3 zero{all(0.f), all(0.f), all(0.f)};
    middle = middle + select(a_in, a, zero) + select(out | in, cut, zero);
    corners_seen += select(a_in, all(1.f), all(0.f)) + select(out | in, all(1.f), all(0.f));
  }
  const V closing = edge_term(n, leaves, enters, enters - leaves, inverse_length(leaves), inverse_length(enters));
  sum += select(crosses, closing, all(0.f));
  const V scale = 1.f / select(corners_seen > 0.f, corners_seen, all(1.f));
  target = select(crosses, scale * middle, target);
  return sum;
}

struct Lanes {
  V3 p, n;            ///< receivers: point and normal
  V3 to_centre;       ///< from the point to the shooter's centre
  M alive;            ///< lanes in front of the shooter's plane
};

/// Lambert's sum over a polygon of `count` corners; `Fixed` > 0 unrolls the loops and keeps the corners in registers.
template <int Fixed>
V polygon_sum(Lanes& lanes, const Outline& outline, V3& target) {
  const FlatShooter& shooter = outline.shooter;
  constexpr int room = Fixed > 0 ? Fixed : FlatShooter::max_corners;
  const int count = Fixed > 0 ? Fixed : shooter.count;
  // A corner as seen from each lane; taken anew where it is needed, since there are not registers for all of them.
  const auto corner_at = [&](int k) { return V3{shooter.x[k] - lanes.p.x, shooter.y[k] - lanes.p.y, shooter.z[k] - lanes.p.z}; };
  V lowest = all(3e38f), highest = all(-3e38f);
  V inverse[room];
  for (int k = 0; k < count; ++k) {
    const V3 corner = corner_at(k);
    const V height = dot(lanes.n, corner);
    lowest = least(height, lowest);
    highest = most(height, highest);
    inverse[k] = inverse_length(corner);
  }
  lanes.alive = lanes.alive & (highest > 0.f);
  if (!any(lanes.alive)) return all(0.f);
  if (any(lanes.alive & (lowest < 0.f))) {
    V3 corner[room];
    V height[room];
    for (int k = 0; k < count; ++k) corner[k] = corner_at(k), height[k] = dot(lanes.n, corner[k]);
    return clipped_sum(lanes.n, outline, corner, height, lowest < 0.f, count, target);
  }

  V sum = all(0.f);
  V3 from = corner_at(0);
  for (int k = 0; k < count; ++k) {
    const int next = k + 1 == count ? 0 : k + 1;
    const V3 to = corner_at(next);
    sum += edge_term(lanes.n, from, to, outline.edge(k), inverse[k], inverse[next]);
    from = to;
  }
  return sum;
}

/// Lanes [at, at + lanes_at_once). @returns their bits, shifted down to 0
std::uint32_t factors(const Receivers16& receivers, int at, std::uint32_t holding, const Outline& outline, float offset,
                      const Aim16& aim, int turn, Factors16& out) {
  const FlatShooter& shooter = outline.shooter;
  Lanes lanes;
  const V3 p = lanes.p = {load(receivers.x + at), load(receivers.y + at), load(receivers.z + at)};
  const V3 n = lanes.n = {load(receivers.nx + at), load(receivers.ny + at), load(receivers.nz + at)};

  // Lanes behind the shooter's plane see its dark side.
  lanes.to_centre = {shooter.cx - p.x, shooter.cy - p.y, shooter.cz - p.z};
  const V in_front =
      -(lanes.to_centre.x * shooter.nx + lanes.to_centre.y * shooter.ny + lanes.to_centre.z * shooter.nz);
  lanes.alive = (in_front > 0.f) & lane_mask(holding);
  V3 target = {load_any(aim.x + at + turn) - p.x, load_any(aim.y + at + turn) - p.y, load_any(aim.z + at + turn) - p.z};
  V sum = all(0.f);
  if (any(lanes.alive))
    sum = shooter.count == 4 ? polygon_sum<4>(lanes, outline, target) : polygon_sum<0>(lanes, outline, target);

  V factor = sum * 0.159154943091895f;
  const M seen = lanes.alive & (factor > 0.f);
  factor = select(seen, factor, all(0.f));
  store(out.factor + at, factor);
  *reinterpret_cast<M*>(out.seen.lane + at) = seen;
  const std::uint32_t bits = bits_of(seen);
  if (bits == 0) return 0;

  // Segments from the lifted receiver to the lifted visible point.
  Segments16& s = out.segments;
  const V ox = p.x + offset * n.x, oy = p.y + offset * n.y, oz = p.z + offset * n.z;
  store(s.ox + at, ox), store(s.oy + at, oy), store(s.oz + at, oz);
  store(s.dx + at, target.x + (p.x - ox) + offset * shooter.nx);
  store(s.dy + at, target.y + (p.y - oy) + offset * shooter.ny);
  store(s.dz + at, target.z + (p.z - oz) + offset * shooter.nz);
  store(s.tfar + at, all(1.f));
  return bits;
}

}  // namespace

std::uint32_t factor16(const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter, const Aim16& aim,
                       int turn, float offset, Factors16& out) {
  const Outline outline(shooter);
  std::uint32_t seen = 0;
  for (int at = 0; at < 16; at += lanes_at_once)
    seen |= factors(receivers, at, lanes >> at, outline, offset, aim, turn, out) << at;
  return seen;
}

float accumulate16(Factors16& factors, const float* area, const float (&value)[3], Sums16& sums) {
  alignas(64) float weight[16];
  for (int at = 0; at < 16; at += lanes_at_once) {
    const V factor = select(load(factors.segments.tfar + at) >= 0.f, load(factors.factor + at), all(0.f));
    store(factors.factor + at, factor);
    for (int c = 0; c < 3; ++c) {
      const V before = load(sums.value[c] + at), added = factor * value[c] + load(sums.rest[c] + at);
      const V after = before + added;
      store(sums.value[c] + at, after);
      store(sums.rest[c] + at, added - (after - before));
    }
    if (area) store(weight + at, factor * load(area + at));
  }
  if (!area) return 0.f;
  // Pairwise, in an order that no vector width changes.
  using Quad = float __attribute__((vector_size(16)));
  const auto quad = [&](int i) { return *reinterpret_cast<const Quad*>(weight + i); };
  const Quad four = (quad(0) + quad(8)) + (quad(4) + quad(12));
  return (four[0] + four[2]) + (four[1] + four[3]);
}

bool block16(const FlatOccluder& occluder, Segments16& segments, LaneMask16& active) {
  const FlatShooter& f = occluder.polygon;
  bool left = false;
  for (int at = 0; at < 16; at += lanes_at_once) {
    M& alive = *reinterpret_cast<M*>(active.lane + at);
    if (!any(alive)) continue;
    const V3 o{load(segments.ox + at), load(segments.oy + at), load(segments.oz + at)};
    const V3 d{load(segments.dx + at), load(segments.dy + at), load(segments.dz + at)};
    // o + t d meets the plane at 0 < t < 1 exactly when its ends lie on different sides.
    const V from = o.x * f.nx + o.y * f.ny + o.z * f.nz - occluder.plane;
    const V across = d.x * f.nx + d.y * f.ny + d.z * f.nz;
    const V to = from + across;
    M blocked = alive & (((from > 0.f) & (to < 0.f)) | ((from < 0.f) & (to > 0.f)));
    if (any(blocked)) {
      const V t = -from / select(blocked, across, all(1.f));
      const V3 p = o + t * d;
      for (int k = 0; k < f.count; ++k)
        blocked = blocked & (p.x * occluder.mx[k] + p.y * occluder.my[k] + p.z * occluder.mz[k] > occluder.edge[k]);
      store(segments.tfar + at, select(blocked, all(-1.f), load(segments.tfar + at)));
      alive = alive & ~blocked;
    }
    left |= any(alive);
  }
  return left;
}

bool hidden8(const float (&box)[3][8], const FlatShooter& shooter, const FlatShooter& occluder, float margin) {
  using W = float __attribute__((vector_size(32)));
  const W bx = *reinterpret_cast<const W*>(box[0]), by = *reinterpret_cast<const W*>(box[1]),
          bz = *reinterpret_cast<const W*>(box[2]);
  const auto all_positive = [](W v) {
    bool positive = true;
    for (int i = 0; i < 8; ++i) positive &= v[i] > 0.f;
    return positive;
  };
  // The occluder's plane separates the box from the shooter ...
  const W box_side = (bx - occluder.x[0]) * occluder.nx + (by - occluder.y[0]) * occluder.ny + (bz - occluder.z[0]) * occluder.nz;
  const float side = box_side[0] > 0 ? 1.f : -1.f;
  if (!all_positive(box_side * side)) return false;
  for (int s = 0; s < shooter.count; ++s) {
    const float d = (shooter.x[s] - occluder.x[0]) * occluder.nx + (shooter.y[s] - occluder.y[0]) * occluder.ny +
                    (shooter.z[s] - occluder.z[0]) * occluder.nz;
    if (d * side >= -margin) return false;
  }
  // ... and each plane through a shooter corner and an edge of the occluder has the whole box on the inner side.
  for (int s = 0; s < shooter.count; ++s)
    for (int k = 0; k < occluder.count; ++k) {
      const int next = k + 1 == occluder.count ? 0 : k + 1;
      const float ax = occluder.x[k] - shooter.x[s], ay = occluder.y[k] - shooter.y[s], az = occluder.z[k] - shooter.z[s];
      const float ex = occluder.x[next] - occluder.x[k], ey = occluder.y[next] - occluder.y[k],
                  ez = occluder.z[next] - occluder.z[k];
      // From the front (side < 0: the box is behind) the corners run counter-clockwise and corner x edge points outwards;
      // from the back it points inwards.
      const float px = (ay * ez - az * ey) * side, py = (az * ex - ax * ez) * side, pz = (ax * ey - ay * ex) * side;
      if (!all_positive((bx - shooter.x[s]) * px + (by - shooter.y[s]) * py + (bz - shooter.z[s]) * pz)) return false;
    }
  return true;
}

std::size_t in_shaft(const Shaft& shaft, const Occluders16* blocks, const ShooterSides* sides, const Candidates* from,
                     std::size_t count, Candidates* to) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Candidates candidates = from[k];
    const Occluders16& o = blocks[candidates.block];
    std::uint32_t inside = 0, above = 0, below = 0;
    for (int at = 0; at < 16; at += lanes_at_once) {
      M in = (load(o.bounds[0] + at) <= shaft.hi[0]) & (load(o.bounds[3] + at) >= shaft.lo[0]);
      for (int axis = 1; axis < 3; ++axis)
        in = in & (load(o.bounds[axis] + at) <= shaft.hi[axis]) & (load(o.bounds[3 + axis] + at) >= shaft.lo[axis]);
      if (!any(in & lane_mask(candidates.lanes >> at))) continue;
      for (int s = 0; s < shaft.planes; ++s) {
        const Shaft::Side& side = shaft.side[s];
        in = in & (load(o.bounds[side.p] + at) * side.a + load(o.bounds[side.q] + at) * side.b <= side.d);
      }
      const V nx = load(o.nx + at), ny = load(o.ny + at), nz = load(o.nz + at);
      const V middle = nx * shaft.centre[0] + ny * shaft.centre[1] + nz * shaft.centre[2] - load(o.plane + at);
      const V reach = absolute(nx) * shaft.half[0] + absolute(ny) * shaft.half[1] + absolute(nz) * shaft.half[2];
      inside |= bits_of(in) << at;
      above |= bits_of(middle - reach >= -shaft.slack) << at;
      below |= bits_of(middle + reach <= shaft.slack) << at;
    }
    const ShooterSides& shooter = sides[candidates.block];
    const std::uint32_t left = candidates.lanes & inside & ~(above & shooter.above) & ~(below & shooter.below);
    if (left != 0) to[kept++] = {candidates.block, left};
  }
  return kept;
}

}  // namespace lichthof::LICHTHOF_WIDTH
