#include "core/tracing/irradiance_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/check.hpp"

namespace lichthof {

namespace {

/// Contact lines are taken at this height above the plane, in sizes of an element.
constexpr double contact_lift = 1e-2;
/// A centre this near to a contact line lies on it, in sizes of an element.
constexpr double contact_tolerance = 1e-4;

/// Contact lines matter up to here from a bin, in sizes of an element: an element reaches half its size beyond its border,
/// its centre lies another half away.
constexpr double contact_reach = 1.5;

/// A slope is carried this far from the centre at most, in sizes of an element. Half is what the rim of a plane needs;
/// the rest is for elements whose centre of gravity lies aside.
constexpr double slope_reach = 0.65;

}  // namespace

// ---- Geometry ---------------------------------------------------------------------------------------------------------

FieldGeometry::FieldGeometry(const Scene& scene, std::shared_ptr<const Mesh> mesh)
    : mesh_(std::move(mesh)), elements_(*mesh_) {
  plane_of_side_.assign(2 * scene.surfaces.size(), none);
  patch_of_.assign(mesh_->elements.size(), 0);
  share_.assign(mesh_->elements.size(), 0.f);
  grids_.resize(mesh_->patches.size());
  for (std::uint32_t p = 0; p < mesh_->patches.size(); ++p) {
    const Patch& patch = mesh_->patches[p];
    PatchGrid& grid = grids_[p];
    grid.lo = patch.lo;
    grid.step = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
    grid.inverse_step = 1.0 / grid.step;
    grid.columns = patch.columns, grid.rows = patch.rows;
    grid.surface = patch.surface.value, grid.back = patch.back;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Element& element = mesh_->elements[e];
      grid.spans |= element.span;
      grid.widest = std::max<int>(grid.widest, element.span);
      patch_of_[e] = p;
      const Vec2 size = size_of(e);
      share_[e] = static_cast<float>(std::clamp(element.area / (size.x * size.y), 1e-6, 1.0));
    }
    plane_of_side_[2 * patch.surface.value + patch.back] = patch.plane.value;
  }
  file_patches();
  find_contacts(scene);
}

void FieldGeometry::file_patches() {
  struct Extent {
    Vec2 lo{1e300}, hi{-1e300}, reach{0.0};
    std::vector<std::uint32_t> patches;
  };
  std::vector<Extent> extents(mesh_->planes.size());
  for (std::uint32_t p = 0; p < grids_.size(); ++p) {
    if (!mesh_->group_is_lit[mesh_->patches[p].group.value]) continue;  // dark sides must not darken their neighbours
    Extent& extent = extents[mesh_->patches[p].plane.value];
    extent.lo = glm::min(extent.lo, mesh_->patches[p].lo), extent.hi = glm::max(extent.hi, mesh_->patches[p].hi);
    extent.reach = glm::max(extent.reach, 0.5001 * widest_size(grids_[p]));
    extent.patches.push_back(p);
  }

  planes_.resize(extents.size());
  bin_first_.push_back(0);
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const Extent& extent = extents[i];
    PlaneBins& bins = planes_[i];
    bins.first = static_cast<std::uint32_t>(bin_first_.size()) - 1;
    if (extent.patches.empty()) continue;
    // About one bin per patch, square.
    const Vec2 size = extent.hi - extent.lo;
    const double count = static_cast<double>(extent.patches.size());
    const double edge = std::max({std::sqrt(size.x * size.y / count), size.x / count, size.y / count});
    bins.columns = std::max(1, static_cast<int>(size.x / edge));
    bins.rows = std::max(1, static_cast<int>(size.y / edge));
    bins.lo = extent.lo;
    bins.inverse_size = Vec2{bins.columns, bins.rows} / size;
    bins.tolerance = contact_tolerance * std::min(extent.reach.x, extent.reach.y);

    std::vector<std::vector<std::uint32_t>> filed(static_cast<std::size_t>(bins.columns) * bins.rows);
    for (const std::uint32_t p : extent.patches) {
      const std::uint32_t first = bin_of(bins, mesh_->patches[p].lo - extent.reach) - bins.first;
      const std::uint32_t last = bin_of(bins, mesh_->patches[p].hi + extent.reach) - bins.first;
      const std::uint32_t columns = static_cast<std::uint32_t>(bins.columns);
      for (std::uint32_t row = first / columns; row <= last / columns; ++row)
        for (std::uint32_t column = first % columns; column <= last % columns; ++column)
          filed[row * columns + column].push_back(p);
    }
    for (const auto& patches : filed) {
      bin_patches_.insert(bin_patches_.end(), patches.begin(), patches.end());
      bin_first_.push_back(static_cast<std::uint32_t>(bin_patches_.size()));
    }
  }
}

void FieldGeometry::find_contacts(const Scene& scene) {
  const SurfaceBoxes boxes(scene);
  contact_first_.assign(bin_first_.size(), 0);
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const PlaneBins& bins = planes_[i];
    for (int row = 0; row < bins.rows; ++row)
      for (int column = 0; column < bins.columns; ++column) {
        const std::uint32_t bin = bins.first + static_cast<std::uint32_t>(row * bins.columns + column);
        Vec2 step{0.0};
        for (std::uint32_t k = bin_first_[bin]; k < bin_first_[bin + 1]; ++k)
          step = glm::max(step, widest_size(grids_[bin_patches_[k]]));
        if (step.x > 0) {
          const Vec2 lo = bins.lo + Vec2{column, row} / bins.inverse_size - contact_reach * step;
          const Vec2 hi = bins.lo + Vec2{column + 1, row + 1} / bins.inverse_size + contact_reach * step;
          const auto lines =
              contact_lines(scene, boxes, mesh_->planes[i], lo, hi, contact_lift * std::min(step.x, step.y));
          contacts_.insert(contacts_.end(), lines.begin(), lines.end());
        }
        contact_first_[bin + 1] = static_cast<std::uint32_t>(contacts_.size());
      }
  }
}

std::uint32_t FieldGeometry::bin_of(const PlaneBins& bins, const Vec2& p) const {
  const Vec2 place = (p - bins.lo) * bins.inverse_size;
  const int column = static_cast<int>(std::clamp(place.x, 0.0, bins.columns - 0.5));
  const int row = static_cast<int>(std::clamp(place.y, 0.0, bins.rows - 0.5));
  return bins.first + static_cast<std::uint32_t>(row * bins.columns + column);
}

bool FieldGeometry::separated(const PlaneBins& bins, std::uint32_t bin, const Vec2& point, const Vec2& middle) const {
  for (std::uint32_t k = contact_first_[bin]; k < contact_first_[bin + 1]; ++k)
    if (separates(contacts_[k], point, middle, bins.tolerance)) return true;
  return false;
}

void FieldGeometry::find(SurfaceId surface, bool back, const Vec3& point, Neighbours& found) const {
  found.count = 0;
  const std::uint32_t plane = plane_of_side_[2 * surface.value + back];
  if (plane == none || planes_[plane].columns == 0) return;
  const PlaneBins& bins = planes_[plane];
  found.at = mesh_->planes[plane].coordinates(point);
  const std::uint32_t bin = bin_of(bins, found.at);

  for (std::uint32_t k = bin_first_[bin]; k < bin_first_[bin + 1]; ++k) {
    const PatchGrid& grid = grids_[bin_patches_[k]];
    const Vec2 place = (found.at - grid.lo) * grid.inverse_step;
    for (int span = 1; span <= grid.widest; span *= 2) {
      if (!(grid.spans & span)) continue;
      // Middles of the elements of this size lie at whole numbers; a tent reaches one unit.
      const int columns = grid.columns / span, rows = grid.rows / span;
      const double x = place.x / span - 0.5, y = place.y / span - 0.5;
      if (!(x > -1 && x < columns && y > -1 && y < rows)) continue;
      const int column = static_cast<int>(x + 1) - 1, row = static_cast<int>(y + 1) - 1;
      const double fx = x - column, fy = y - row;
      for (int corner = 0; corner < 4; ++corner) {
        const int c = column + (corner & 1), r = row + (corner >> 1);
        if (c < 0 || r < 0 || c >= columns || r >= rows) continue;
        const std::uint32_t element = elements_.at(bin_patches_[k], c * span, r * span);
        if (element == none || mesh_->elements[element].span != span) continue;
        const double weight = (corner & 1 ? fx : 1 - fx) * (corner >> 1 ? fy : 1 - fy);
        if (weight <= 0 || found.count == found.items.size()) continue;
        if (separated(bins, bin, found.at, centre(element))) continue;
        found.items[found.count++] = {element, static_cast<float>(weight) * share_[element]};
      }
    }
  }
  if (found.count == 0) nearest_visible(bins, bin, found);
}

void FieldGeometry::nearest_visible(const PlaneBins& bins, std::uint32_t bin, Neighbours& found) const {
  double best = 1e300, best_any = 1e300;
  std::uint32_t chosen = none, any = none;
  for (std::uint32_t k = bin_first_[bin]; k < bin_first_[bin + 1]; ++k)
    for (const std::uint32_t element : elements_of(bin_patches_[k])) {
      const Vec2 d = centre(element) - found.at;
      const double distance = glm::dot(d, d);
      if (distance < best_any) best_any = distance, any = element;
      if (distance < best && !separated(bins, bin, found.at, centre(element))) best = distance, chosen = element;
    }
  // A nook that no centre can be seen from: its own element is the best there is.
  if (chosen == none) chosen = any;
  if (chosen != none) found.items[0] = {chosen, 1.f}, found.count = 1;
}

std::optional<std::uint32_t> FieldGeometry::element_at(SurfaceId surface, bool back, const Vec3& point) const {
  const std::uint32_t plane = plane_of_side_[2 * surface.value + back];
  if (plane == none || planes_[plane].columns == 0) return std::nullopt;
  const Vec2 p = mesh_->planes[plane].coordinates(point);
  const std::uint32_t bin = bin_of(planes_[plane], p);
  double best = 1e300;
  std::uint32_t chosen = none;
  for (std::uint32_t k = bin_first_[bin]; k < bin_first_[bin + 1]; ++k) {
    const PatchGrid& grid = grids_[bin_patches_[k]];
    if (grid.surface != surface.value || grid.back != back) continue;
    const Vec2 place = (p - grid.lo) * grid.inverse_step;
    if (place.x < -1e-6 || place.y < -1e-6 || place.x > grid.columns + 1e-6 || place.y > grid.rows + 1e-6) continue;
    const int column = std::clamp(static_cast<int>(place.x), 0, grid.columns - 1);
    const int row = std::clamp(static_cast<int>(place.y), 0, grid.rows - 1);
    const std::uint32_t own = elements_.at(bin_patches_[k], column, row);
    if (own != none && share_[own] > 0.999f) return own;
    // At slanted borders rectangles overlap: the nearest centre wins.
    for (const std::uint32_t element : elements_of(bin_patches_[k])) {
      const Vec2 d = centre(element) - p;
      if (glm::dot(d, d) < best) best = glm::dot(d, d), chosen = element;
    }
  }
  if (chosen == none) return std::nullopt;
  return chosen;
}

bool FieldGeometry::near_contact(SurfaceId surface, bool back, const Vec3& point) const {
  const std::uint32_t plane = plane_of_side_[2 * surface.value + back];
  if (plane == none || planes_[plane].columns == 0) return false;
  const std::uint32_t bin = bin_of(planes_[plane], mesh_->planes[plane].coordinates(point));
  return contact_first_[bin] != contact_first_[bin + 1];
}

std::vector<std::uint32_t> FieldGeometry::touching(std::uint32_t element) const {
  const Patch& patch = mesh_->patches[patch_of_[element]];
  const PlaneBins& bins = planes_[patch.plane.value];
  std::vector<std::uint32_t> found;
  if (bins.columns == 0) return found;
  Vec2 lo, hi;
  mesh_->element_rectangle(patch, mesh_->elements[element], lo, hi);
  const Vec2 size = hi - lo;
  const std::uint32_t bin = bin_of(bins, centre(element));
  for (std::uint32_t k = bin_first_[bin]; k < bin_first_[bin + 1]; ++k) {
    const PatchGrid& grid = grids_[bin_patches_[k]];
    const Vec2 slack = 1e-4 * (size + grid.step);
    const Vec2 first = glm::floor((lo - slack - grid.lo) * grid.inverse_step),
               last = glm::floor((hi + slack - grid.lo) * grid.inverse_step);
    // Clamped before they are whole numbers: beside a needle they may be larger than those go.
    const auto left = static_cast<int>(std::clamp<double>(first.x, 0, grid.columns)),
               top = static_cast<int>(std::clamp<double>(first.y, 0, grid.rows));
    const auto right = static_cast<int>(std::clamp<double>(last.x + 1, 0, grid.columns)),
               bottom = static_cast<int>(std::clamp<double>(last.y + 1, 0, grid.rows));
    elements_.for_each_in(bin_patches_[k], left, right, top, bottom, [&](std::uint32_t other) {
      if (other != element && !separated(bins, bin, centre(element), centre(other))) found.push_back(other);
    });
  }
  return found;
}

// ---- Values -----------------------------------------------------------------------------------------------------------

IrradianceField::IrradianceField(std::shared_ptr<const FieldGeometry> geometry, std::span<const Rgb> values)
    : geometry_(std::move(geometry)) {
  MUST(values.size() == geometry_->mesh().elements.size());
  nodes_.reserve(values.size());
  for (std::uint32_t e = 0; e < values.size(); ++e) nodes_.push_back(fitted(e, values));
}

IrradianceField::Node IrradianceField::fitted(std::uint32_t element, std::span<const Rgb> values) const {
  const Vec2 centre = geometry_->centre(element);
  Node node;
  node.value = Rgbf{values[element]};
  Rgb lowest = values[element], highest = lowest, right_u{0.0}, right_v{0.0};
  double uu = 0, uv = 0, vv = 0;
  for (const std::uint32_t other : geometry_->touching(element)) {
    const Vec2 d = geometry_->centre(other) - centre;
    const double weight = 1.0 / std::max(glm::dot(d, d), 1e-300);
    const Rgb difference = values[other] - values[element];
    uu += weight * d.x * d.x, uv += weight * d.x * d.y, vv += weight * d.y * d.y;
    right_u += weight * d.x * difference, right_v += weight * d.y * difference;
    // What a smaller neighbour, nearer by, differs by is carried on to where one of the same size would be.
    const Vec2 sizes = glm::abs(d) / geometry_->size_of(element);
    const Rgb far = values[element] + difference / std::clamp(std::max(sizes.x, sizes.y), 0.5, 1.0);
    lowest = glm::min(lowest, far), highest = glm::max(highest, far);
  }

  // Least squares by the two principal directions; a direction without neighbours has no slope.
  const double mean = 0.5 * (uu + vv), spread = std::sqrt(0.25 * (uu - vv) * (uu - vv) + uv * uv);
  const double large = mean + spread;
  if (!(large > 0)) return node;
  Vec2 axis = std::abs(uv) > 1e-12 * large ? Vec2{uv, large - uu} : (uu >= vv ? Vec2{1, 0} : Vec2{0, 1});
  axis = glm::normalize(axis);
  Rgb slope_u{0.0}, slope_v{0.0};
  for (const auto& [direction, strength] : {std::pair{axis, large}, std::pair{Vec2{-axis.y, axis.x}, mean - spread}}) {
    if (strength < 1e-3 * large) continue;
    const Rgb slope = (direction.x * right_u + direction.y * right_v) / strength;
    slope_u += direction.x * slope, slope_v += direction.y * slope;
  }

  // Limit: within half an element the value stays in the neighbours' range, widened by half of it, and not below zero.
  const Vec2 half = 0.5 * geometry_->size_of(element);
  for (int channel = 0; channel < 3; ++channel) {
    const double swing = std::abs(slope_u[channel]) * half.x + std::abs(slope_v[channel]) * half.y;
    if (swing <= 0) continue;
    const double value = values[element][channel], widening = 0.5001 * (highest[channel] - lowest[channel]);
    const double below = value - std::max(0.0, lowest[channel] - widening), above = highest[channel] + widening - value;
    const double factor = std::clamp(std::min(below, above) / swing, 0.0, 1.0);
    node.slope_u[channel] = static_cast<float>(factor * slope_u[channel]);
    node.slope_v[channel] = static_cast<float>(factor * slope_v[channel]);
  }
  return node;
}

Rgb IrradianceField::at(SurfaceId surface, bool back, const Vec3& point) const {
  FieldGeometry::Neighbours near;
  geometry_->find(surface, back, point, near);
  if (near.count == 0) return Rgb{0.0};
  float total = 0;
  Vec2 centre{0.0}, widest{0.0};
  Rgbf value{0.f}, slope_u{0.f}, slope_v{0.f};
  for (std::uint32_t k = 0; k < near.count; ++k) {
    const auto [element, weight] = near.items[k];
    const Node& node = nodes_[element];
    total += weight;
    value += weight * node.value, slope_u += weight * node.slope_u, slope_v += weight * node.slope_v;
    centre += static_cast<double>(weight) * geometry_->centre(element);
    widest = glm::max(widest, geometry_->size_of(element));
  }
  const double scale = 1.0 / total;
  // Slopes hold near their elements; where contact lines leave only far ones, they are not carried on.
  const Vec2 reach = slope_reach * widest;
  const Vec2 rest = glm::clamp(near.at - scale * centre, -reach, reach);
  return glm::max(scale * (Rgb{value} + rest.x * Rgb{slope_u} + rest.y * Rgb{slope_v}), Rgb{0.0});
}

}  // namespace lichthof
