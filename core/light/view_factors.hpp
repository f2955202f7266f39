/// View factors between the surfaces of a scene, with obstruction: F_ij is the share of what leaves i diffusely that reaches
/// j on a straight way. Sides count as one row together where they have the same group: the pieces of a face, a material.
///
/// Every pair is computed once, as its exchange area A_i F_ij = A_j F_ji; so reciprocity holds by construction. What checks the
/// figures are the sums of rows, which nothing forces to be 1 in a closed scene, and a sample of pairs that are computed a
/// second time the other way round, over the other polygon. Where the two differ by more than their estimates both are taken
/// further; what then is left between them goes into the estimate.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// One side of a surface that takes part.
struct ViewSide {
  std::uint32_t surface = 0;
  bool back = false;
  std::uint32_t group = 0;  ///< row and column it counts to
};

struct ViewFactorOptions {
  double tolerance = 1e-6;              ///< allowed error of F between two sides, for the smaller of the two (1)
  std::uint64_t most_points = 200000;   ///< a pair is given up then, with the error it has
  std::uint32_t pairs_both_ways = 200;  ///< about so many are computed a second time
  std::vector<char> rows = {};          ///< per group: it is asked for; empty: all. Only pairs with one of those count
  const std::atomic<bool>* stop = nullptr;  ///< when it rises, what was reached is returned within seconds
};

struct ViewFactors {
  std::uint32_t count = 0;       ///< groups
  std::vector<double> areas;     ///< per group (m²)
  std::vector<double> exchange;  ///< A_i F_ij, count x count, symmetric (m²)
  std::vector<double> errors;    ///< estimates of their errors, likewise (m²)

  std::uint64_t pairs_facing = 0;      ///< pairs of sides in front of each other
  std::uint64_t pairs_obstructed = 0;  ///< those with something between
  std::uint64_t pairs_inexact = 0;     ///< those whose error is above the tolerance
  std::uint64_t pairs_missing = 0;     ///< those that were not reached before the stop: NaN in both matrices
  std::uint64_t points = 0;            ///< points that were looked from

  std::uint64_t pairs_both_ways = 0;    ///< pairs of sides that were computed a second time
  double reciprocity_defect = 0;        ///< largest |A_i F_ij - A_j F_ji| of those, as a share of the smaller area (1)
  double reciprocity_defect_m2 = 0;     ///< the same pair's (m²)
  std::uint64_t pairs_disagreeing = 0;  ///< of those: further apart than the estimates of both errors allow
  std::uint32_t defect_row = 0, defect_column = 0;  ///< its groups

  double factor(std::size_t i, std::size_t j) const { return exchange[i * count + j] / areas[i]; }
  double error(std::size_t i, std::size_t j) const { return errors[i * count + j] / areas[i]; }
  double row_sum(std::size_t i) const;
};

/// @param scene        all its surfaces obstruct, glass and mirrors too
/// @param sides        rows; a surface may take part with its front, its back, or both
/// @param group_count  above every side's group
/// @param progress     told the share that is done, from any thread; may be empty
/// @error  of F between two sides at most options.tolerance, or as far as most_points led: see `errors`. Planes are taken for
///         equal, and things for touching, within 1e-7 of the scene's size
/// @cost   O(n²) pairs of sides that face each other, each with a look at all surfaces (10 ns apiece); pairs with nothing
///         between some 50 µs, others 100 points and more of some µs. 16 bytes per entry, 24 per pair with exchange
/// @source [Sparrow63], [Walton02]
ViewFactors view_factors(const Scene& scene, std::span<const ViewSide> sides, std::uint32_t group_count,
                         const ViewFactorOptions& options, const Parallel& parallel,
                         const std::function<void(double)>& progress = {});

}  // namespace lichthof
