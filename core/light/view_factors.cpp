#include "core/light/view_factors.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/check.hpp"
#include "core/light/convex_solids.hpp"
#include "core/light/exchange_area.hpp"
#include "core/light/obstructed_exchange.hpp"

namespace lichthof {

namespace {

/// Heights over a plane below this share of the scene's size are none: what files with six digits leave of one plane. But
/// beside slivers they are, from this share of the sliver's width on.
constexpr double plane_share = 1e-7, width_share = 1e-4;

struct Side {
  Polygon corners;
  Vec3 normal;
  double offset = 0, area = 0;
  std::uint32_t group = 0;
  double tolerance = 0;        ///< of planes (m)
  std::vector<char> clear_of;  ///< per solid: it is in front of the side's plane, and the side outside of it
  double height(const Vec3& p) const { return glm::dot(normal, p) - offset; }
};

/// A surface, or what of it is in front of a side.
struct Part {
  Obstruction shape;
  std::uint32_t solid = no_solid;  ///< that it is a face of
  static constexpr std::uint32_t no_solid = 0xffffffffu;
};

struct Entry {
  std::uint32_t column = 0;
  double area = 0, error = 0;  ///< exchange area and its error (m²)
};

struct Row {
  std::vector<Entry> entries;  ///< of columns beyond the row's own number, with exchange
  std::uint64_t facing = 0, obstructed = 0, points = 0;
  std::uint32_t end = 0;  ///< columns from here on were not reached
};

/// A pair that was computed both ways.
struct Check {
  Entry settled;   ///< the first way, taken further where the second disagreed
  Exchange again;  ///< the second way
  std::uint64_t points = 0;
  bool disagrees = false;  ///< in the end: further apart than the estimates of both errors allow
  double defect() const { return std::abs(again.area - settled.area); }
};

/// Of a polygon much longer than wide: its width (m).
double mean_width(const Polygon& corners) {
  double perimeter = 0;
  for (std::size_t k = 0; k < corners.size(); ++k)
    perimeter += glm::length(corners[k + 1 < corners.size() ? k + 1 : 0] - corners[k]);
  return 2 * area(corners) / perimeter;
}

class Matrix {
 public:
  Matrix(const Scene& scene, std::span<const ViewSide> sides, const ViewFactorOptions& options);
  Row row(std::uint32_t i) const;
  std::uint32_t side_count() const { return static_cast<std::uint32_t>(sides_.size()); }
  const Side& side(std::uint32_t i) const { return sides_[i]; }
  double allowed_error(std::uint32_t i, std::uint32_t j) const { return allowed_error(sides_[i], sides_[j]); }
  /// Whether a pair counts at all.
  bool is_wanted(std::uint32_t i, std::uint32_t j) const { return is_wanted(sides_[i]) || is_wanted(sides_[j]); }
  /// Whether some of each is in front of the other.
  bool faces(std::uint32_t i, std::uint32_t j) const { return faces(sides_[i], sides_[j]); }
  bool is_stopped() const { return options_.stop && *options_.stop; }
  Check checked(std::uint32_t i, const Entry& entry) const;

 private:
  std::vector<Part> in_front_of(const Side& side) const;
  bool stands_clear(const ConvexSolid& solid, const Side& side, std::uint32_t surface) const;
  bool faces(const Side& a, const Side& b) const;
  Exchange exchange(const Side& a, const Side& b, std::span<const Part> in_front, double allowed_error,
                    bool second) const;
  FacingPair facing_pair(const Side& a, const Side& b, std::span<const Part> in_front) const;
  double tolerance_of(const Side& a, const Side& b) const { return std::min(a.tolerance, b.tolerance); }
  double allowed_error(const Side& a, const Side& b) const { return options_.tolerance * std::min(a.area, b.area); }
  bool is_wanted(const Side& side) const { return options_.rows.empty() || options_.rows[side.group]; }

  ViewFactorOptions options_;
  double plane_tolerance_ = 0;  ///< m
  std::vector<Side> sides_;
  std::vector<Part> parts_;          ///< all surfaces, the largest first: they are the likeliest to hide much
  std::vector<ConvexSolid> solids_;  ///< into which some of them join
};

Matrix::Matrix(const Scene& scene, std::span<const ViewSide> sides, const ViewFactorOptions& options)
    : options_(options) {
  const double size = glm::length(bounds(scene).size());
  plane_tolerance_ = plane_share * size;
  for (const ViewSide& side : sides) {
    const Surface& surface = scene.surfaces[side.surface];
    Side s{surface.corners, surface.normal, 0, surface.area, side.group, 0, {}};
    s.tolerance = std::min(plane_tolerance_, width_share * mean_width(s.corners));
    if (side.back) std::reverse(s.corners.begin(), s.corners.end()), s.normal = -s.normal;
    s.offset = glm::dot(s.normal, s.corners[0]);
    sides_.push_back(std::move(s));
  }
  solids_ = convex_solids(scene.surfaces, plane_tolerance_);
  std::stable_sort(solids_.begin(), solids_.end(), [](const ConvexSolid& a, const ConvexSolid& b) {
    return glm::length(a.shape.box.size()) > glm::length(b.shape.box.size());
  });
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (const ConvexSolid& solid : solids_)
      sides_[i].clear_of.push_back(stands_clear(solid, sides_[i], sides[i].surface));
  std::vector<std::uint32_t> solid_of(scene.surfaces.size(), Part::no_solid), by_area(scene.surfaces.size());
  for (std::uint32_t k = 0; k < solids_.size(); ++k)
    for (const std::uint32_t surface : solids_[k].surfaces) solid_of[surface] = k;
  std::iota(by_area.begin(), by_area.end(), 0u);
  std::stable_sort(by_area.begin(), by_area.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return scene.surfaces[a].area > scene.surfaces[b].area; });
  for (const std::uint32_t i : by_area)
    parts_.push_back({obstruction(scene.surfaces[i].corners, scene.surfaces[i].normal), solid_of[i]});
}

/// Whether the solid as a whole may stand between the side and what else it is clear of.
bool Matrix::stands_clear(const ConvexSolid& solid, const Side& side, std::uint32_t surface) const {
  return std::all_of(solid.shape.corners.begin(), solid.shape.corners.end(),
                     [&](const Vec3& p) { return side.height(p) >= -side.tolerance; }) &&
         is_outside(solid, surface, side.corners, side.normal, side.tolerance);
}

/// What can stand between this side and anything: the surfaces' parts above its plane.
std::vector<Part> Matrix::in_front_of(const Side& side) const {
  std::vector<Part> in_front;
  for (const Part& part : parts_) {
    Polygon above = clipped(part.shape.corners, side.normal, side.offset, side.tolerance);
    if (!above.empty()) in_front.push_back({obstruction(std::move(above), part.shape.planes[0].normal), part.solid});
  }
  return in_front;
}

bool Matrix::faces(const Side& a, const Side& b) const {
  const double tolerance = tolerance_of(a, b);
  const auto some_above = [&](const Side& plane, const Side& polygon) {
    return std::any_of(polygon.corners.begin(), polygon.corners.end(),
                       [&](const Vec3& p) { return plane.height(p) > tolerance; });
  };
  return some_above(a, b) && some_above(b, a);
}

/// @param in_front  what is in front of a
FacingPair Matrix::facing_pair(const Side& a, const Side& b, std::span<const Part> in_front) const {
  FacingPair pair;
  const double tolerance = tolerance_of(a, b);
  pair.receiver = clipped(a.corners, b.normal, b.offset, tolerance);
  pair.source = clipped(b.corners, a.normal, a.offset, tolerance);
  pair.receiver_normal = a.normal;
  if (pair.receiver.empty() || pair.source.empty()) return pair;
  const ViewShaft shaft(pair.receiver, pair.source, tolerance);
  const auto as_a_whole = [&](std::uint32_t solid) {
    return solid != Part::no_solid && a.clear_of[solid] && b.clear_of[solid];
  };
  for (std::uint32_t k = 0; k < solids_.size(); ++k)
    if (as_a_whole(k) && shaft.may_hold(solids_[k].shape)) pair.between.push_back(solids_[k].shape);
  for (const auto& [shape, solid] : in_front) {
    if (as_a_whole(solid) || !shaft.may_hold(shape)) continue;
    Polygon part = clipped(shape.corners, b.normal, b.offset, tolerance);
    if (part.empty()) continue;
    Obstruction cut = obstruction(std::move(part), shape.planes[0].normal);
    if (shaft.may_hold(cut)) pair.between.push_back(std::move(cut));
  }
  return pair;
}

FacingPair turned(const FacingPair& pair, const Side& source) {
  return {pair.source, pair.receiver, source.normal, pair.between};
}

/// The smaller polygon is looked from, for it sees the other one change less; among polygons of like size the one with less
/// standing on it.
bool receives_better(const FacingPair& pair, const FacingPair& turned, double tolerance) {
  const double here = area(pair.receiver), there = area(turned.receiver);
  if (here > 4 * there || there > 4 * here) return here < there;
  const std::size_t on_here = standing_count(pair, tolerance), on_there = standing_count(turned, tolerance);
  return on_here != on_there ? on_here < on_there : here <= there;
}

/// One of the two ways to a pair's exchange.
/// @param second  the other way round than the first, and by quadrature alone
Exchange Matrix::exchange(const Side& a, const Side& b, std::span<const Part> in_front, double allowed_error,
                          bool second) const {
  const double tolerance = tolerance_of(a, b);
  const FacingPair pair = facing_pair(a, b, in_front);
  if (pair.receiver.empty() || pair.source.empty()) return {};
  if (!second && pair.between.empty()) return {exchange_area(pair.receiver, pair.source), 0, 0};
  if (!second)
    for (const Obstruction& o : pair.between)
      if (hides_all(o, pair.receiver, pair.source, tolerance)) return {0, 0, 1};
  const FacingPair other = turned(pair, b);
  return obstructed_exchange(receives_better(pair, other, tolerance) != second ? pair : other, allowed_error, tolerance,
                             options_.most_points, second ? Clear::quadrature : Clear::contour);
}

Row Matrix::row(std::uint32_t i) const {
  Row result;
  if (is_stopped()) {
    result.end = i + 1;
    return result;
  }
  const std::vector<Part> in_front = in_front_of(sides_[i]);
  for (result.end = i + 1; result.end < sides_.size() && !is_stopped(); ++result.end) {
    const std::uint32_t j = result.end;
    if (!is_wanted(i, j) || !faces(sides_[i], sides_[j])) continue;
    const Exchange e = exchange(sides_[i], sides_[j], in_front, allowed_error(i, j), false);
    ++result.facing;
    result.obstructed += e.points > 0;
    result.points += e.points;
    if (e.area > 0 || e.error > 0) result.entries.push_back({j, e.area, e.error});
  }
  return result;
}

/// The pair's exchange the other way round. Where the two ways disagree both are taken further, until they agree or are given
/// up; what then is left between them goes into the estimate.
Check Matrix::checked(std::uint32_t i, const Entry& entry) const {
  constexpr double further = 1.0 / 8;
  constexpr int most_rounds = 3;
  const Side &a = sides_[i], &b = sides_[entry.column];
  const std::vector<Part> in_front = in_front_of(a);
  double allowed = allowed_error(a, b);
  Check check{entry, exchange(a, b, in_front, allowed, true)};
  // Where nothing stood between, the first way was exact but for rounding: 1e-9 is above all that is left of it.
  const double rounding = 1e-9 * std::min(a.area, b.area);
  const auto differ = [&] { return check.defect() > check.again.error + check.settled.error + rounding; };
  for (int round = 0; round < most_rounds && differ() && !is_stopped(); ++round) {
    allowed *= further;
    const Exchange again = exchange(a, b, in_front, allowed, false);
    check.settled.area = again.area, check.settled.error = again.error;
    check.again = exchange(a, b, in_front, allowed, true);
    check.points += again.points;
  }
  check.disagrees = differ();
  if (check.disagrees) check.settled.error = std::max(check.settled.error, check.defect());
  return check;
}

/// Adds the rows up by group, in the order of sides.
void sum_up(ViewFactors& result, const Matrix& matrix, const std::vector<Row>& rows) {
  const auto add = [&](std::uint32_t i, std::uint32_t j, const Entry& entry) {
    result.exchange[std::size_t{i} * result.count + j] += entry.area;
    result.errors[std::size_t{i} * result.count + j] += entry.error;
  };
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    result.areas[matrix.side(i).group] += matrix.side(i).area;
    result.pairs_facing += rows[i].facing;
    result.pairs_obstructed += rows[i].obstructed;
    result.points += rows[i].points;
    for (const Entry& entry : rows[i].entries) {
      result.pairs_inexact += entry.error > matrix.allowed_error(i, entry.column);
      add(matrix.side(i).group, matrix.side(entry.column).group, entry);
      add(matrix.side(entry.column).group, matrix.side(i).group, entry);
    }
    // What was not reached is not known, nor any sum with it.
    for (std::uint32_t j = rows[i].end; j < rows.size(); ++j) {
      if (!matrix.is_wanted(i, j) || !matrix.faces(i, j)) continue;
      ++result.pairs_missing;
      const Entry unknown{j, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
      add(matrix.side(i).group, matrix.side(j).group, unknown);
      add(matrix.side(j).group, matrix.side(i).group, unknown);
    }
  }
}

/// Computes every so many pairs a second time; where the two ways differed, the rows get what they were settled at.
void check_both_ways(ViewFactors& result, const Matrix& matrix, std::vector<Row>& rows, std::uint32_t wanted,
                     const Parallel& parallel) {
  struct Sample {
    std::uint32_t row;
    Entry* entry;
    Check check;
  };
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < rows.size(); ++i)
    for (Entry& entry : rows[i].entries) samples.push_back({i, &entry, {}});
  if (wanted == 0) return;
  const std::size_t stride = std::max<std::size_t>(1, samples.size() / wanted);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < samples.size(); k += stride) samples[kept++] = samples[k];
  samples.resize(kept);
  parallel.for_each(kept, [&](std::size_t k) {
    if (!matrix.is_stopped()) samples[k].check = matrix.checked(samples[k].row, *samples[k].entry);
  });
  if (matrix.is_stopped()) return;
  result.pairs_both_ways = kept;
  for (const Sample& sample : samples) {
    const Side &a = matrix.side(sample.row), &b = matrix.side(sample.entry->column);
    const Check& check = sample.check;
    const double smaller = std::min(a.area, b.area), share = check.defect() / smaller;
    *sample.entry = check.settled;
    result.points += check.points;
    result.pairs_disagreeing += check.disagrees;
    if (share <= result.reciprocity_defect) continue;
    result.reciprocity_defect = share;
    result.reciprocity_defect_m2 = check.defect();
    result.defect_row = a.group, result.defect_column = b.group;
  }
}

}  // namespace

double ViewFactors::row_sum(std::size_t i) const {
  double sum = 0;
  for (std::size_t j = 0; j < count; ++j) sum += exchange[i * count + j];
  return sum / areas[i];
}

ViewFactors view_factors(const Scene& scene, std::span<const ViewSide> sides, std::uint32_t group_count,
                         const ViewFactorOptions& options, const Parallel& parallel,
                         const std::function<void(double)>& progress) {
  MUST(options.tolerance > 0);
  const Matrix matrix(scene, sides, options);
  std::vector<Row> rows(sides.size());
  const double pairs = 0.5 * static_cast<double>(sides.size()) * (static_cast<double>(sides.size()) - 1);
  std::atomic<std::uint64_t> done{0};
  parallel.for_each(rows.size(), [&](std::size_t i) {
    rows[i] = matrix.row(static_cast<std::uint32_t>(i));
    const std::uint64_t now = done += rows.size() - 1 - i;
    if (progress && pairs > 0) progress(static_cast<double>(now) / pairs);
  });
  ViewFactors result;
  result.count = group_count;
  result.areas.assign(group_count, 0);
  result.exchange.assign(std::size_t{group_count} * group_count, 0);
  result.errors = result.exchange;
  check_both_ways(result, matrix, rows, options.pairs_both_ways, parallel);
  sum_up(result, matrix, rows);
  return result;
}

}  // namespace lichthof
