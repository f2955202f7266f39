#include "core/light/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

#include "core/base/check.hpp"
#include "core/light/one_cell.hpp"
#include "core/scene/element_grids.hpp"

namespace lichthof {

namespace {

/// How many elements a look may have that quarters them once, and twice. Finer meshes have no look, and are fine enough.
constexpr std::size_t most_to_look_at[] = {4000000, 400000};
/// Where shooting ends for the look: luminaires, and what they light most, have shot. Edges and contacts are there by then.
constexpr double eps_of_look = 0.05;
/// No element is divided that has less than this many times the mean: all elements alike may then as well be smaller.
constexpr double uneven = 2.5;
/// Light that the look leaves unshot makes deviations of its own: in a furnace 4e-4 (relative).
constexpr double least_seen = 1e-3;
/// A mesh that leaves more than this share of what can be taken is no better.
constexpr double worth_it = 0.8;
/// Of the deviation of an element that the look saw as one this share is left when it is quartered: 1/16 where light is smooth, 1/2
/// along a shadow's edge, which is where most of it is.
constexpr double left_of_unseen = 0.4;

/// The plane a + b x + c y through weighted values, by normal equations about the centre of gravity.
class PlaneFit {
 public:
  void add(const Vec2& at, double weight, double value) { samples_.push_back({at, weight, value}); }

  /// Mean square of value - plane, as if the plane was none of the values' own: of mere noise it is the same for any number of them.
  double deviation() const {
    double weight = 0, mean = 0;
    Vec2 middle{0.0};
    for (const Sample& s : samples_) weight += s.weight, mean += s.weight * s.value, middle += s.weight * s.at;
    if (!(weight > 0)) return 0;
    mean /= weight, middle /= weight;
    double xx = 0, xy = 0, yy = 0, xv = 0, yv = 0;
    for (const Sample& s : samples_) {
      const Vec2 d = s.at - middle;
      xx += s.weight * d.x * d.x, xy += s.weight * d.x * d.y, yy += s.weight * d.y * d.y;
      xv += s.weight * d.x * (s.value - mean), yv += s.weight * d.y * (s.value - mean);
    }
    // A row of elements has no slope across: its part of the solution is left at 0.
    const double trace = xx + yy, determinant = xx * yy - xy * xy;
    Vec2 slope{0.0};
    if (determinant > 1e-9 * trace * trace)
      slope = {(yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant};
    else if (trace > 0)
      slope = Vec2{xv, yv} / trace;
    double sum = 0;
    for (const Sample& s : samples_) {
      const double rest = s.value - mean - glm::dot(slope, s.at - middle);
      sum += s.weight * rest * rest;
    }
    const auto count = static_cast<double>(samples_.size());
    return count > 3 ? sum / weight * count / (count - 3) : 0;
  }

 private:
  struct Sample {
    Vec2 at;
    double weight, value;
  };
  std::vector<Sample> samples_;
};

/// Index of each patch's first place, and in the end their number.
std::vector<std::size_t> first_places(const Mesh& mesh) {
  std::vector<std::size_t> first{0};
  for (const Patch& patch : mesh.patches)
    first.push_back(first.back() + std::size_t{shooting_columns(patch)} * shooting_rows(patch));
  return first;
}

/// A look at the light with elements smaller than those of a mesh.
class Look {
 public:
  Look(const std::shared_ptr<const Scene>& scene, const Mesh& mesh, int levels, const Parallel& parallel)
      : mesh_(std::make_shared<const Mesh>(mesh_of(*scene, mesh.options, mesh.lit_sides, deeper(mesh, levels)))),
        elements_(*mesh_) {
    MUST(mesh_->patches.size() == mesh.patches.size());
    Solution rough = blank_solution(scene, mesh_);
    shoot_in_one_cell(rough, eps_of_look, parallel);
    irradiance_ = std::move(rough.irradiance);
  }

  /// Σ A H² ((W/m²)² m²).
  double squares() const {
    double sum = 0;
    for (std::size_t e = 0; e < irradiance_.size(); ++e)
      sum += static_cast<double>(mesh_->elements[e].area) * glm::dot(irradiance_[e], irradiance_[e]);
    return sum;
  }

  /// A square of a patch's grid, as the look has it.
  struct Square {
    std::uint32_t patch;
    int column, row, span;
    Square quarter(int right, int down) const {
      return {patch, column + right * span / 2, row + down * span / 2, span / 2};
    }
  };
  /// @param patch  and element: of the mesh that is looked at
  Square square_of(std::uint32_t patch_index, const Patch& patch, const Element& element) const {
    const int scale = mesh_->patches[patch_index].fineness / patch.fineness;
    return {patch_index, element.column * scale, element.row * scale, element.span * scale};
  }

  /// A d² of a square ((W/m²)² m²): d from the plane that fits best to what is seen in and around it.
  /// @param is_one  the look saw it as a single element
  double deviation(const Square& square, bool& is_one) const {
    std::array<PlaneFit, 3> fits;
    double area = 0;
    int finest = square.span;
    for_each_around(square, 0, [&](std::uint32_t e) {
      area += mesh_->elements[e].area;
      finest = std::min<int>(finest, mesh_->elements[e].span);
    });
    is_one = finest == square.span;
    for_each_around(square, finest, [&](std::uint32_t e) {
      const Element& element = mesh_->elements[e];
      for (int c = 0; c < 3; ++c)
        fits[static_cast<std::size_t>(c)].add(element.centre, element.area, irradiance_[e][c]);
    });
    double sum = 0;
    for (const PlaneFit& fit : fits) sum += fit.deviation();
    return area * sum;
  }

 private:
  /// A square and a rim around it, shifted inwards where the patch ends.
  template <class Each>
  void for_each_around(const Square& square, int rim, Each&& each) const {
    const auto window = [&](int first, int whole) {
      const int size = square.span + 2 * rim, low = std::clamp(first - rim, 0, std::max(whole - size, 0));
      return std::pair(low, std::min(low + size, whole));
    };
    const Patch& patch = mesh_->patches[square.patch];
    const auto [left, right] = window(square.column, patch.columns);
    const auto [top, bottom] = window(square.row, patch.rows);
    elements_.for_each_in(square.patch, left, right, top, bottom, each);
  }
  static std::vector<PlaceTree> deeper(const Mesh& mesh, int levels) {
    std::vector<PlaceTree> places = places_of(mesh);
    const std::vector<std::size_t> first_place = first_places(mesh);
    for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
      const Patch& patch = mesh.patches[p];
      if (!mesh.group_is_lit[patch.group.value]) continue;
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
        divide(places[first_place[p] + shooting_place(patch, mesh.elements[e])], node_of(patch, mesh.elements[e]),
               levels);
    }
    return places;
  }
  static void divide(PlaceTree& place, const PlaceTree::Node& node, int levels) {
    if (levels == 0 || node.level == PlaceTree::most_levels) return;
    place.divide(node);
    for (const int down : {0, 1})
      for (const int right : {0, 1}) divide(place, node.quarter(right, down), levels - 1);
  }

  std::shared_ptr<const Mesh> mesh_;
  ElementGrids elements_;
  std::vector<Rgbf> irradiance_;
};

/// An element that may be divided.
struct Candidate {
  double deviation;
  std::size_t place;
  PlaceTree::Node node;
  Look::Square square;
  bool is_one;  ///< nothing is known of its quarters
  auto key() const { return std::tuple(deviation, place, node.level, node.row, node.column); }
  bool operator<(const Candidate& other) const { return key() < other.key(); }
};

}  // namespace

std::shared_ptr<const Mesh> refined_mesh(const std::shared_ptr<const Scene>& scene,
                                         const std::shared_ptr<const Mesh>& from, double keep,
                                         const Parallel& parallel) {
  MUST(keep > 0 && keep < 1);
  const Mesh& mesh = *from;
  int levels = static_cast<int>(std::size(most_to_look_at));
  while (levels > 0 && mesh.elements.size() << 2 * levels > most_to_look_at[levels - 1]) --levels;
  if (levels == 0) return from;
  const Look look(scene, mesh, levels, parallel);
  std::vector<PlaceTree> places = places_of(mesh);
  const std::vector<std::size_t> first_place = first_places(mesh);

  std::priority_queue<Candidate> candidates;
  double left = 0;
  std::size_t count = 0;  // of what light can reach
  const auto add = [&](std::size_t place, const PlaceTree::Node& node, const Look::Square& square) {
    Candidate candidate{0, place, node, square, false};
    candidate.deviation = look.deviation(square, candidate.is_one);
    left += candidate.deviation;
    if (node.level < PlaceTree::most_levels) candidates.push(candidate);
  };
  for (std::uint32_t p = 0; p < mesh.patches.size(); ++p) {
    const Patch& patch = mesh.patches[p];
    if (!mesh.group_is_lit[patch.group.value]) continue;
    count += patch.element_count;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      add(first_place[p] + shooting_place(patch, mesh.elements[e]), node_of(patch, mesh.elements[e]),
          look.square_of(p, patch, mesh.elements[e]));
  }

  const double whole = left, wanted = std::max(keep * whole, least_seen * least_seen * look.squares());
  while (left > wanted && !candidates.empty()) {
    const Candidate candidate = candidates.top();
    candidates.pop();
    if (candidate.deviation < uneven * left / static_cast<double>(count)) break;
    places[candidate.place].divide(candidate.node);
    count += 3;
    left -= candidate.deviation;
    if (candidate.is_one)
      left += left_of_unseen * candidate.deviation;
    else
      for (const int down : {0, 1})
        for (const int right : {0, 1})
          add(candidate.place, candidate.node.quarter(right, down), candidate.square.quarter(right, down));
  }
  if (!(whole > 0 && left <= worth_it * whole)) return from;
  return std::make_shared<const Mesh>(mesh_of(*scene, mesh.options, mesh.lit_sides, places));
}

}  // namespace lichthof
