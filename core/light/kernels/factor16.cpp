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
inline V all(float s) { return s - V{}; }  // s + 0 is not s when s is -0
inline V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator*(const V& s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline V dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V select(M m, V a, V b) { return m ? a : b; }
inline V3 select(M m, const V3& a, const V3& b) { return {m ? a.x : b.x, m ? a.y : b.y, m ? a.z : b.z}; }

// One instruction each; the compiler makes compare and blend of the portable form. The second of two equal values counts.
#if LICHTHOF_LANES == 4
inline V least(V a, V b) {
  return reinterpret_cast<V>(_mm_min_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b)));
}
inline V most(V a, V b) {
  return reinterpret_cast<V>(_mm_max_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b)));
}
#elif LICHTHOF_LANES == 8
inline V least(V a, V b) {
  return reinterpret_cast<V>(_mm256_min_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
inline V most(V a, V b) {
  return reinterpret_cast<V>(_mm256_max_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
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
constexpr M bit_of_lane{1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
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
  const V p01 = 1.2091995900717911f + y * -0.26360016626526517f,
          p23 = 0.06973250427637592f + y * -0.019836653439004072f,
          p45 = 0.005867037097824852f + y * -0.00177564106674307f,
          p67 = 0.0005300576221218733f + y * -0.00016329768749869802f,
          p89 = 6.895964119280507e-05f + y * -2.240252905210127e-05f;
  return (p01 + y2 * p23) + y4 * ((p45 + y2 * p67) + y4 * p89);
}

/// A place in the shooter's plane, seen from the foot of each lane's perpendicular on it. All places of the polygon have the
/// same height over the receiver, which saves a third of Lambert's sum.
struct V2 {
  V u, v;
};
inline V2 operator-(const V2& a, const V2& b) { return {a.u - b.u, a.v - b.v}; }
inline V2 operator+(const V2& a, const V2& b) { return {a.u + b.u, a.v + b.v}; }
inline V2 operator*(const V& s, const V2& a) { return {s * a.u, s * a.v}; }
inline V2 select(M m, const V2& a, const V2& b) { return {m ? a.u : b.u, m ? a.v : b.v}; }

/// 16 / width receivers in the shooter's frame (u, v, normal).
struct Lanes {
  V2 foot;    ///< of the receiver on the shooter's plane, from the shooter's centre (m)
  V height2;  ///< squared distance to that plane (m²)
  V2 n;       ///< receiver's normal, along u and v
  V nw;       ///< and along the shooter's normal
  V2 lean;    ///< n times the shooter's height over the receiver (m)
  V level;    ///< nw times that height (m)
  M alive;    ///< lanes in front of the shooter's plane

  /// Above the receiver's own horizon (m).
  V above(const V2& a) const { return a.u * n.u + a.v * n.v + level; }
  /// n · (e x a) for an edge e from a.
  V turned(const V2& e, const V2& a) const { return e.u * (a.v * nw - lean.v) - e.v * (a.u * nw - lean.u); }
  /// 1 / length of the way from the receiver.
  V inverse_length(const V2& a) const { return 1.f / square_root(a.u * a.u + a.v * a.v + height2); }
};

/// θ/sinθ of an edge e from a, where its cosine is negative: there sinθ must come from the cross product, as sqrt(1 - cos²)
/// cancels near θ = π. @param ratio  of |cosine|, kept in other lanes
inline V beyond_right_angle(const Lanes& lanes, const V2& a, const V2& e, V cosine, V scale, V ratio) {
  const V flat = e.u * a.v - e.v * a.u;
  const V sine = square_root((e.u * e.u + e.v * e.v) * lanes.height2 + flat * flat) * scale;
  const V safe = select(sine > 1e-12f, sine, all(1e-12f));
  return select(cosine < 0.f, 3.14159265358979f / safe - ratio, ratio);
}

/// One edge of Lambert's sum, times 2π: angle(a, b) · n · unit(b × a), from the edge e = b - a (difference form).
inline V edge_term(const Lanes& lanes, const V2& a, const V2& b, const V2& e) {
  const V scale = lanes.inverse_length(a) * lanes.inverse_length(b);
  const V cosine = (a.u * b.u + a.v * b.v + lanes.height2) * scale;
  V ratio = theta_over_sine(least(all(1.f), absolute(cosine)));
  if (any(cosine < 0.f)) ratio = beyond_right_angle(lanes, a, e, cosine, scale, ratio);
  return ratio * lanes.turned(e, a) * scale;
}

inline V2 corner_at(const FlatShooter& s, const Lanes& lanes, int k) {
  return {s.u[k] - lanes.foot.u, s.v[k] - lanes.foot.v};
}
/// Edges are the same for all lanes, and have no rounding of the receivers' places.
inline V2 edge_at(const FlatShooter& s, int k) { return {all(s.eu[k]), all(s.ev[k])}; }

struct Sum {
  V sum;
  M crosses;  ///< lanes whose horizon crosses the polygon,
  V2 middle;  ///< and there the middle of what is seen
};

/// The general case: some lanes see the polygon across their horizon. Every lane clips for itself; a convex polygon
/// leaves the upper half space at most once and comes back at most once, so one closing edge along the horizon suffices.
/// Lanes whose horizon cuts nothing get the very bits of the simple case: which lanes share a register is a matter of width.
[[gnu::noinline]] Sum clipped_sum(Lanes lanes, const FlatShooter& shooter, M cut_lanes, int count) {
  const V2 zero{all(0.f), all(0.f)};
  V sum = all(0.f), corners_seen = all(0.f);
  V2 leaves = zero, enters = zero, total = zero;
  M crosses = sum > 1.f;
  V2 a = corner_at(shooter, lanes, 0);
  V ha = lanes.above(a);
  for (int k = 0; k < count; ++k) {
    const V2 b = corner_at(shooter, lanes, k + 1 == count ? 0 : k + 1);
    const V hb = lanes.above(b);
    const M a_in = (ha > 0.f) | ~cut_lanes, b_in = (hb > 0.f) | ~cut_lanes;
    const M out = a_in & ~b_in, in = ~a_in & b_in, used = a_in | b_in;
    if (any(used)) {
      const V span = ha - hb;
      const V t = ha / select(out | in, span, all(1.f));
      const V2 cut = a + t * (b - a);
      const V2 from = select(in, cut, a), to = select(out, cut, b);
      const V2 edge = select(a_in & b_in, edge_at(shooter, k), to - from);
      const V term = edge_term(lanes, from, to, edge);
      sum += select(used, term, all(0.f));
      leaves = select(out, cut, leaves);
      enters = select(in, cut, enters);
      crosses = crosses | out;
      total = total + select(a_in, a, zero) + select(out | in, cut, zero);
      corners_seen += select(a_in, all(1.f), all(0.f)) + select(out | in, all(1.f), all(0.f));
    }
    a = b, ha = hb;
  }
  sum += select(crosses, edge_term(lanes, leaves, enters, enters - leaves), all(0.f));
  return {sum, crosses, (1.f / select(corners_seen > 0.f, corners_seen, all(1.f))) * total};
}

/// What must be divided, for the lanes of one register. `Fixed` > 0 is the number of corners, and unrolls the loops.
template <int Fixed>
struct Corners {
  static constexpr int room = Fixed > 0 ? Fixed : FlatShooter::max_corners;
  static int count(const FlatShooter& shooter) { return Fixed > 0 ? Fixed : shooter.count; }

  Lanes lanes;
  V height;           ///< of the shooter's plane over the receiver (m)
  V inverse[room];    ///< of the distances of the corners (1/m)
  V lowest, highest;  ///< corner over the horizon (m)

  /// Lanes [at, at + lanes_at_once), of which `holding` hold receivers.
  inline void measure(const Receivers16& receivers, int at, std::uint32_t holding, const FlatShooter& shooter,
                      float offset) {
    const V3 n = {load(receivers.nx + at), load(receivers.ny + at), load(receivers.nz + at)};
    const V3 u{all(shooter.ux), all(shooter.uy), all(shooter.uz)}, v{all(shooter.vx), all(shooter.vy), all(shooter.vz)},
        w{all(shooter.nx), all(shooter.ny), all(shooter.nz)};
    const V3 to_centre = {shooter.cx - load(receivers.x + at), shooter.cy - load(receivers.y + at),
                          shooter.cz - load(receivers.z + at)};
    height = dot(to_centre, w);
    lanes.alive = (height < 0.f) & lane_mask(holding);  // lanes behind the shooter's plane see its dark side
    lanes.foot = {-dot(to_centre, u), -dot(to_centre, v)};
    lanes.height2 = height * height + 1e-37f;  // a corner at the receiver itself contributes nothing: all is 0 there
    lanes.n = {dot(n, u), dot(n, v)};
    lanes.nw = dot(n, w);
    lanes.lean = height * lanes.n;
    lanes.level = height * lanes.nw;
    lowest = all(3e38f), highest = all(-3e38f);
    for (int k = 0; k < count(shooter); ++k) {
      const V2 corner = corner_at(shooter, lanes, k);
      const V above = lanes.above(corner);
      lowest = least(above, lowest);
      highest = most(above, highest);
      inverse[k] = lanes.inverse_length(corner);
    }
    // Where neither rises over the other's plane by more than rays are lifted, both lie in one: the rest is rounding.
    lanes.alive = lanes.alive & (highest > 0.f) & (most(-height, highest) > offset);
  }

  /// Lambert's sum over the polygon.
  inline Sum sum(const FlatShooter& shooter) const {
    if (!any(lanes.alive)) return {all(0.f), lanes.alive, V2{}};
    // What lies a millionth below the horizon adds 1e-12, but would have all walls clip the floor's edges by rounding.
    const M cut = lowest < -1e-6f * highest;
    if (any(lanes.alive & cut)) return clipped_sum(lanes, shooter, cut, count(shooter));
    V scale[room], cosine[room], smallest = all(1.f);
    for (int k = 0; k < count(shooter); ++k) {
      const int next = k + 1 == count(shooter) ? 0 : k + 1;
      const V2 from = corner_at(shooter, lanes, k), to = corner_at(shooter, lanes, next);
      scale[k] = inverse[k] * inverse[next];
      cosine[k] = (from.u * to.u + from.v * to.v + lanes.height2) * scale[k];
      smallest = least(cosine[k], smallest);
    }
    const M wide = smallest < 0.f;
    V sum = all(0.f);
    for (int k = 0; k < count(shooter); ++k) {
      const V2 from = corner_at(shooter, lanes, k), edge = edge_at(shooter, k);
      V ratio = theta_over_sine(least(all(1.f), absolute(cosine[k])));
      if (any(wide)) ratio = beyond_right_angle(lanes, from, edge, cosine[k], scale[k], ratio);
      sum += ratio * lanes.turned(edge, from) * scale[k];
    }
    return {sum, sum > 3e38f, V2{}};
  }
};

/// Of lanes [at, at + lanes_at_once). @returns their bits, shifted down to 0
std::uint32_t store_factors(const Receivers16& receivers, int at, const FlatShooter& shooter, float offset,
                            const Aim16& aim, int turn, M alive, V height, const Sum& sum, Factors16& out) {
  V factor = sum.sum * 0.159154943091895f;
  const M seen = alive & (factor > 0.f);
  factor = select(seen, factor, all(0.f));
  store(out.factor + at, factor);
  *reinterpret_cast<M*>(out.seen.lane + at) = seen;
  const std::uint32_t bits = bits_of(seen);
  if (bits == 0) return 0;

  // Segments from the lifted receiver to the lifted visible point.
  const V3 p = {load(receivers.x + at), load(receivers.y + at), load(receivers.z + at)};
  const V3 n = {load(receivers.nx + at), load(receivers.ny + at), load(receivers.nz + at)};
  V3 target = {load_any(aim.x + at + turn) - p.x, load_any(aim.y + at + turn) - p.y, load_any(aim.z + at + turn) - p.z};
  if (any(sum.crosses)) {
    const V2& m = sum.middle;
    const V3 middle{m.u * shooter.ux + m.v * shooter.vx + height * shooter.nx,
                    m.u * shooter.uy + m.v * shooter.vy + height * shooter.ny,
                    m.u * shooter.uz + m.v * shooter.vz + height * shooter.nz};
    target = select(sum.crosses, middle, target);
  }
  Segments16& s = out.segments;
  const V ox = p.x + offset * n.x, oy = p.y + offset * n.y, oz = p.z + offset * n.z;
  store(s.ox + at, ox), store(s.oy + at, oy), store(s.oz + at, oz);
  store(s.dx + at, target.x + (p.x - ox) + offset * shooter.nx);
  store(s.dy + at, target.y + (p.y - oy) + offset * shooter.ny);
  store(s.dz + at, target.z + (p.z - oz) + offset * shooter.nz);
  store(s.tfar + at, all(1.f));
  return bits;
}

template <int Fixed>
std::uint32_t factors(const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter, const Aim16& aim,
                      int turn, float offset, Factors16& out) {
  // All divisions are under way before the first result is needed: they, not the sums, are what one waits for.
  Corners<Fixed> corners[16 / lanes_at_once];
  for (int at = 0; at < 16; at += lanes_at_once)
    corners[at / lanes_at_once].measure(receivers, at, lanes >> at, shooter, offset);
  std::uint32_t seen = 0;
  for (int at = 0; at < 16; at += lanes_at_once) {
    const Corners<Fixed>& c = corners[at / lanes_at_once];
    seen |= store_factors(receivers, at, shooter, offset, aim, turn, c.lanes.alive, c.height, c.sum(shooter), out)
            << at;
  }
  return seen;
}

}  // namespace

std::uint32_t factor16(const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter, const Aim16& aim,
                       int turn, float offset, Factors16& out) {
  return shooter.count == 4 ? factors<4>(receivers, lanes, shooter, aim, turn, offset, out)
                            : factors<0>(receivers, lanes, shooter, aim, turn, offset, out);
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

bool block16(const FlatOccluder& face, Segments16& segments, LaneMask16& active) {
  bool left = false;
  for (int at = 0; at < 16; at += lanes_at_once) {
    M& alive = *reinterpret_cast<M*>(active.lane + at);
    if (!any(alive)) continue;
    const V3 o{load(segments.ox + at), load(segments.oy + at), load(segments.oz + at)};
    const V3 d{load(segments.dx + at), load(segments.dy + at), load(segments.dz + at)};
    // o + t d meets the plane at 0 < t < 1 exactly when its ends lie on different sides.
    const V from = o.x * face.nx + o.y * face.ny + o.z * face.nz - face.plane;
    const V across = d.x * face.nx + d.y * face.ny + d.z * face.nz;
    const V to = from + across;
    M blocked = alive & (((from > 0.f) & (to < 0.f)) | ((from < 0.f) & (to > 0.f)));
    if (any(blocked)) {
      const V t = -from / select(blocked, across, all(1.f));
      const V3 p = o + t * d;
      for (const OccluderEdge& edge : face.edges)
        blocked = blocked & (p.x * edge.mx + p.y * edge.my + p.z * edge.mz > edge.least);
      store(segments.tfar + at, select(blocked, all(-1.f), load(segments.tfar + at)));
      alive = alive & ~blocked;
    }
    left |= any(alive);
  }
  return left;
}

bool hidden8(const float (&box)[3][8], const FlatPolygon& shooter, const FlatOccluder& occluder, float margin) {
  using W = float __attribute__((vector_size(32)));
  const W bx = *reinterpret_cast<const W*>(box[0]), by = *reinterpret_cast<const W*>(box[1]),
          bz = *reinterpret_cast<const W*>(box[2]);
  const auto all_positive = [](W v) {
    bool positive = true;
    for (int i = 0; i < 8; ++i) positive &= v[i] > 0.f;
    return positive;
  };
  // The occluder's plane separates the box from the shooter ...
  const OccluderEdge& first = occluder.edges[0];
  const W box_side = (bx - first.x) * occluder.nx + (by - first.y) * occluder.ny + (bz - first.z) * occluder.nz;
  const float side = box_side[0] > 0 ? 1.f : -1.f;
  if (!all_positive(box_side * side)) return false;
  for (int s = 0; s < shooter.count; ++s) {
    const float d = (shooter.x[s] - first.x) * occluder.nx + (shooter.y[s] - first.y) * occluder.ny +
                    (shooter.z[s] - first.z) * occluder.nz;
    if (d * side >= -margin) return false;
  }
  // ... and each plane through a shooter corner and an edge of the occluder has the whole box on the inner side.
  for (int s = 0; s < shooter.count; ++s)
    for (std::size_t k = 0; k < occluder.edges.size(); ++k) {
      const OccluderEdge &from = occluder.edges[k], &to = occluder.edges[k + 1 == occluder.edges.size() ? 0 : k + 1];
      const float ax = from.x - shooter.x[s], ay = from.y - shooter.y[s], az = from.z - shooter.z[s];
      const float ex = to.x - from.x, ey = to.y - from.y, ez = to.z - from.z;
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
