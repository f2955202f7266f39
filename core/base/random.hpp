/// Random numbers with the same bits on every machine: PCG32 [ONeill14], the R2 low-discrepancy sequence [Roberts18],
/// and our own mappings to floating point (the standard's distributions differ between libraries).
#pragma once

#include <cstdint>

#include "core/base/types.hpp"

namespace lichthof {

/// Mixes 64 bits (splitmix64 finaliser): a seed from a coordinate, never a stream by itself.
inline std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// PCG32 (XSH-RR).
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : increment_((stream << 1) | 1) {
    bits();
    state_ += mix64(seed);
    bits();
  }
  std::uint32_t bits() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ull + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
    const auto rotation = static_cast<std::uint32_t>(old >> 59);
    return (shifted >> rotation) | (shifted << ((32 - rotation) & 31));
  }
  /// Uniform in [0, 1).
  double unit() { return bits() * 0x1p-32; }
  /// Uniform integer in [0, bound); bound ≥ 1. The bias is below bound / 2³².
  std::uint32_t below(std::uint32_t bound) {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(bits()) * bound) >> 32);
  }

 private:
  std::uint64_t state_ = 0;
  std::uint64_t increment_;
};

/// Point `index` of the two-dimensional R2 sequence, shifted by `shift` on the unit torus (a Cranley-Patterson rotation).
inline Vec2 r2_point(std::uint32_t index, const Vec2& shift) {
  const double x = shift.x + 0.7548776662466927 * (index + 1);
  const double y = shift.y + 0.5698402909980532 * (index + 1);
  return {x - static_cast<double>(static_cast<std::int64_t>(x)), y - static_cast<double>(static_cast<std::int64_t>(y))};
}

/// Direction of the cosine-weighted hemisphere around +z for a point of the unit square: pdf = cosθ/π (1/sr).
Vec3 cosine_direction(const Vec2& unit_square);

/// Two unit vectors that complete `normal` to a right-handed frame {tangent, bitangent, normal} [Duff17].
void complete_frame(const Vec3& normal, Vec3& tangent, Vec3& bitangent);

}  // namespace lichthof
