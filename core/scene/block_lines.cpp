#include "core/scene/block_lines.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/ties.hpp"

namespace lichthof {

namespace {

/// Places nearer than 1e-6 of so many blocks are one, or of the scene where that is smaller.
constexpr double blocks_of_detail = 128;

struct Interval {
  double lo, hi;
};

/// A union of intervals. What lies in the longest so far is dropped at once: floors hold nearly all.
class Intervals {
 public:
  void add(const Interval& added) {
    if (!all_.empty() && added.lo >= all_[longest_].lo && added.hi <= all_[longest_].hi) return;
    all_.push_back(added);
    if (added.hi - added.lo > all_[longest_].hi - all_[longest_].lo) longest_ = all_.size() - 1;
  }

  std::vector<Interval> merged() const {
    std::vector<Interval> sorted = all_, joined;
    std::sort(sorted.begin(), sorted.end(), [](const Interval& a, const Interval& b) { return a.lo < b.lo; });
    for (const Interval& next : sorted)
      if (!joined.empty() && next.lo <= joined.back().hi)
        joined.back().hi = std::max(joined.back().hi, next.hi);
      else
        joined.push_back(next);
    return joined;
  }

 private:
  std::vector<Interval> all_;
  std::size_t longest_ = 0;
};

/// Where sides of each coarseness reach along an axis.
std::array<Intervals, most_coarse + 1> reaches(const Scene& scene, std::span<const LitSides> lit, int axis) {
  std::array<Intervals, most_coarse + 1> by_coarseness;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    const LitSides sides = lit.empty() ? LitSides{} : lit[s];
    if (scene.material_of(surface).finish == Finish::glass || !(sides.front || sides.back)) continue;
    Interval reach{1e300, -1e300};
    for (const Vec3& c : surface.corners)
      reach.lo = std::min(reach.lo, c[axis]), reach.hi = std::max(reach.hi, c[axis]);
    if (sides.front) by_coarseness[std::min(sides.front_coarse, most_coarse)].add(reach);
    if (sides.back) by_coarseness[std::min(sides.back_coarse, most_coarse)].add(reach);
  }
  return by_coarseness;
}

}  // namespace

BlockWidths::BlockWidths(const Scene& scene, std::span<const LitSides> lit, int axis, double block) {
  constexpr double everywhere = std::numeric_limits<double>::infinity();
  stretches_ = {{-everywhere, everywhere, everywhere}};
  const auto by_coarseness = reaches(scene, lit, axis);
  // From coarse to fine: finer sides take their place from coarser ones.
  for (int coarse = most_coarse; coarse >= 0; --coarse) {
    const double width = block * coarsening(static_cast<std::uint8_t>(coarse));
    const std::vector<Interval> own = by_coarseness[static_cast<std::size_t>(coarse)].merged();
    if (own.empty()) continue;
    std::vector<Stretch> all;
    std::size_t next = 0;
    double up_to = -everywhere;  // is settled
    for (const Stretch& old : stretches_) {
      while (next < own.size() && own[next].lo < old.hi) {
        const double lo = std::max(up_to, own[next].lo), hi = own[next].hi;
        if (lo > std::max(old.lo, up_to)) all.push_back({std::max(old.lo, up_to), lo, old.width});
        // A side seen edge-on reaches over a single place, and is as fine there.
        if (hi >= lo) all.push_back({lo, hi, width}), up_to = hi;
        ++next;
      }
      if (old.hi > up_to) all.push_back({std::max(old.lo, up_to), old.hi, old.width}), up_to = old.hi;
    }
    stretches_ = std::move(all);
  }
  grade();
}

void BlockWidths::grade() {
  std::vector<Stretch> graded;
  for (std::size_t k = 0; k < stretches_.size(); ++k) {
    Stretch rest = stretches_[k];
    const double middle = 0.5 * (rest.lo + rest.hi);
    std::vector<Stretch> above;
    if (std::isfinite(rest.width)) {
      if (k > 0)
        for (double w = 2 * stretches_[k - 1].width; w < rest.width && rest.lo + w < middle; w *= 2)
          graded.push_back({rest.lo, rest.lo + w, w}), rest.lo += w;
      if (k + 1 < stretches_.size())
        for (double w = 2 * stretches_[k + 1].width; w < rest.width && rest.hi - w > middle; w *= 2)
          above.push_back({rest.hi - w, rest.hi, w}), rest.hi -= w;
    }
    graded.push_back(rest);
    graded.insert(graded.end(), above.rbegin(), above.rend());
  }
  stretches_ = std::move(graded);
}

double BlockWidths::finest() const {
  return std::min_element(stretches_.begin(), stretches_.end(),
                          [](const Stretch& a, const Stretch& b) { return a.width < b.width; })
      ->width;
}

double BlockWidths::at(double coordinate) const {
  const auto from = std::lower_bound(stretches_.begin(), stretches_.end(), coordinate,
                                     [](const Stretch& s, double x) { return s.hi < x; });
  double narrowest = std::numeric_limits<double>::infinity();
  for (auto s = from; s != stretches_.end() && s->lo <= coordinate; ++s) narrowest = std::min(narrowest, s->width);
  return narrowest;
}

double BlockWidths::count(double lo, double hi) const {
  double blocks = 0;
  for (const Stretch& s : stretches_) blocks += std::max(0.0, std::min(hi, s.hi) - std::max(lo, s.lo)) / s.width;
  return blocks;
}

void BlockWidths::add_parts(double lo, double hi, int parts, std::vector<double>& lines) const {
  const auto inside =
      std::upper_bound(stretches_.begin(), stretches_.end(), lo, [](double x, const Stretch& s) { return x < s.hi; });
  if (inside->hi >= hi) {
    for (int p = 0; p < parts; ++p) lines.push_back(lo + (hi - lo) * p / parts);
    return;
  }
  const double blocks = count(lo, hi);
  double before = 0;  // blocks of the stretches passed
  auto s = inside;
  for (int p = 0; p < parts; ++p) {
    const double wanted = blocks * p / parts;
    const auto in_stretch = [&] { return (std::min(hi, s->hi) - std::max(lo, s->lo)) / s->width; };
    while (s + 1 != stretches_.end() && before + in_stretch() < wanted) before += in_stretch(), ++s;
    lines.push_back(p == 0 ? lo : std::max(lo, s->lo) + (wanted - before) * s->width);
  }
}

std::vector<double> block_lines(const Scene& scene, const Box& box, int axis, const BlockWidths& widths) {
  const double lo = box.lo[axis], hi = box.hi[axis];
  const double extent = max_channel(box.size());
  const double tolerance = 1e-6 * std::min(extent, blocks_of_detail * widths.finest());
  if (hi - lo < tolerance) {
    const double margin = std::min(widths.at(lo), extent) / 2;
    return {lo - margin, hi + margin};
  }

  struct Candidate {
    double coordinate, length;
  };
  std::vector<Candidate> edges;
  for (const Surface& surface : scene.surfaces)
    for (std::size_t k = 0; k < surface.corners.size(); ++k) {
      const Vec3& a = surface.corners[k];
      const Vec3& b = surface.corners[(k + 1) % surface.corners.size()];
      if (std::abs(a[axis] - b[axis]) <= tolerance) edges.push_back({a[axis], glm::length(b - a)});
    }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.coordinate < b.coordinate; });
  std::vector<Candidate> merged;
  for (const Candidate& edge : edges) {
    if (!merged.empty() && edge.coordinate - merged.back().coordinate <= tolerance)
      merged.back().length += edge.length;
    else
      merged.push_back(edge);
  }
  // Edges of one length in the order of their places: rounding does not choose.
  const auto steps = [&](const Candidate& edge) { return step_of(edge.length, tolerance); };
  std::stable_sort(merged.begin(), merged.end(), [&](const auto& a, const auto& b) { return steps(a) > steps(b); });

  // An edge earns a line of its own when it is at least as long as a block, and no other line is near.
  std::vector<double> fixed{lo, hi};
  for (const Candidate& candidate : merged) {
    const double block = widths.at(candidate.coordinate);
    if (candidate.length < 2 * block - tolerance) continue;
    const auto next = std::lower_bound(fixed.begin(), fixed.end(), candidate.coordinate);
    const double gap_above = next == fixed.end() ? 1e300 : *next - candidate.coordinate;
    const double gap_below = next == fixed.begin() ? 1e300 : candidate.coordinate - *(next - 1);
    if (std::min(gap_above, gap_below) >= 0.4 * block - tolerance) fixed.insert(next, candidate.coordinate);
  }
  std::vector<double> lines;
  for (std::size_t i = 0; i + 1 < fixed.size(); ++i) {
    const int parts = std::max(1, static_cast<int>(std::ceil(widths.count(fixed[i], fixed[i + 1]) - 0.2)));
    widths.add_parts(fixed[i], fixed[i + 1], parts, lines);
  }
  lines.push_back(hi);
  return lines;
}

std::size_t block_of(const std::vector<double>& lines, double coordinate) {
  const auto above = std::upper_bound(lines.begin(), lines.end(), coordinate);
  const auto index = static_cast<std::ptrdiff_t>(above - lines.begin()) - 1;
  return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(index, 0, static_cast<std::ptrdiff_t>(lines.size()) - 2));
}

}  // namespace lichthof
