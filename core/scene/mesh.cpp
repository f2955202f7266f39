#include "core/scene/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/base/check.hpp"
#include "core/base/ties.hpp"

namespace lichthof {

namespace {

// ---- Planes -----------------------------------------------------------------------------------------------------------

/// Finds the oriented plane of a surface side, or makes it. Planes agree within 1e-6 in normal and 1e-6 of the scene's
/// size in offset: coarser than rounding of any sensible file, finer than any gap that is meant.
class PlaneTable {
 public:
  PlaneTable(double scene_size, const Vec3& middle) : offset_step_(4e-6 * scene_size), middle_(middle) {}

  PlaneId find_or_add(const Vec3& normal, const Vec3& point, std::vector<Plane>& planes) {
    const std::array<double, 4> exact{normal.x / normal_step_, normal.y / normal_step_, normal.z / normal_step_,
                                      glm::dot(normal, point - middle_) / offset_step_};
    // Values close to the border of a bin are looked up on both sides of it.
    std::array<std::array<std::int64_t, 2>, 4> bins;
    std::array<int, 4> choices;
    for (int i = 0; i < 4; ++i) {
      const double low = std::floor(exact[i]);
      const double part = exact[i] - low;
      bins[i][0] = static_cast<std::int64_t>(low);
      bins[i][1] = bins[i][0] + (part > 0.75 ? 1 : -1);
      choices[i] = part > 0.75 || part < 0.25 ? 2 : 1;
    }
    for (int a = 0; a < choices[0]; ++a)
      for (int b = 0; b < choices[1]; ++b)
        for (int c = 0; c < choices[2]; ++c)
          for (int d = 0; d < choices[3]; ++d)
            if (const auto found = table_.find({bins[0][a], bins[1][b], bins[2][c], bins[3][d]}); found != table_.end())
              return found->second;
    const PlaneId id{static_cast<std::uint32_t>(planes.size())};
    table_[{bins[0][0], bins[1][0], bins[2][0], bins[3][0]}] = id;
    planes.push_back(frame_of(normal, point));
    return id;
  }

 private:
  static Plane frame_of(const Vec3& normal, const Vec3& point) {
    Plane plane{point, {}, {}, normal};
    if (std::abs(normal.z) > 1 - 1e-12) {
      plane.u = {1, 0, 0};
      plane.v = {0, normal.z > 0 ? 1.0 : -1.0, 0};
    } else {
      plane.v = glm::normalize(Vec3{0, 0, 1} - normal.z * normal);
      plane.u = glm::cross(plane.v, normal);
    }
    return plane;
  }

  static constexpr double normal_step_ = 4e-6;
  double offset_step_;
  Vec3 middle_;
  std::map<std::array<std::int64_t, 4>, PlaneId> table_;
};

// ---- Blocks -----------------------------------------------------------------------------------------------------------

Vec3 axis_direction(int axis) { return {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0}; }

void extent_along(std::span<const Vec3> corners, int axis, double& lo, double& hi) {
  lo = 1e300, hi = -1e300;
  for (const Vec3& c : corners) lo = std::min(lo, c[axis]), hi = std::max(hi, c[axis]);
}

/// The pieces of a convex polygon in the blocks it crosses.
std::vector<Polygon> block_pieces(const Polygon& whole, const std::array<std::vector<double>, 3>& lines,
                                  double tolerance) {
  std::vector<Polygon> pieces{whole};
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Polygon> cut;
    for (Polygon& piece : pieces) {
      double lo, hi;
      extent_along(piece, axis, lo, hi);
      const std::size_t first = block_of(lines[axis], lo + tolerance), last = block_of(lines[axis], hi - tolerance);
      if (first >= last) {
        cut.push_back(std::move(piece));
        continue;
      }
      for (std::size_t k = first; k <= last; ++k) {
        Polygon part = piece;
        if (k > first) part = clipped(part, axis_direction(axis), lines[axis][k], tolerance);
        if (k < last && !part.empty()) part = clipped(part, -axis_direction(axis), -lines[axis][k + 1], tolerance);
        if (!part.empty()) cut.push_back(std::move(part));
      }
    }
    pieces = std::move(cut);
  }
  return pieces;
}

/// Kernels and shots work with polygons of few corners: a disc of 64 is cut into pieces of at most `most`.
std::vector<Polygon> limited(std::vector<Polygon> polygons, std::size_t most) {
  std::vector<Polygon> result;
  while (!polygons.empty()) {
    Polygon polygon = std::move(polygons.back());
    polygons.pop_back();
    if (polygon.size() <= most) {
      result.push_back(std::move(polygon));
      continue;
    }
    const auto half = static_cast<std::ptrdiff_t>(polygon.size() / 2);
    Polygon rest(polygon.begin() + half, polygon.end());
    rest.push_back(polygon.front());
    polygon.resize(static_cast<std::size_t>(half) + 1);
    polygons.push_back(std::move(rest));
    polygons.push_back(std::move(polygon));
  }
  std::reverse(result.begin(), result.end());
  return result;
}

// ---- The cutter -------------------------------------------------------------------------------------------------------

/// How often every place is quartered, where elements are asked for that are smaller than the 16 places a patch shoots from.
int base_levels(const MeshOptions& options) {
  const double places_along = options.patch_size / options.element_size / 4;
  return static_cast<int>(std::clamp(std::round(std::log2(places_along)), 0.0, 3.0));
}

/// Of a place that shoots (m).
double usual_place_size(const MeshOptions& options) { return options.element_size * (1 << base_levels(options)); }

/// How many times a group is halved along each axis: until about 8x8 elements that shoot have become patches.
int halvings(const MeshOptions& options) {
  const double places_along = options.patch_size / usual_place_size(options);
  return 3 - static_cast<int>(std::clamp(std::round(std::log2(places_along)), 0.0, 2.0));
}

class Cutter {
 public:
  /// A patch is cut from its group by four lines at most, and an element from its patch: up to 8 corners more; the kernels take
  /// 20 (FlatShooter::max_corners).
  static constexpr std::size_t max_group_corners = 10;

  Cutter(const Scene& scene, Mesh& mesh, const Box& box)
      : scene_(scene), mesh_(mesh), tolerance_(1e-7 * detail_of(mesh, box)),
        planes_(detail_of(mesh, box), box.centre()) {
    for (const Surface& surface : scene.surfaces) emitted_ += emitted_by(surface);
  }

  /// @param coarse  LitSides
  void cut_side(std::uint32_t surface_index, bool back, std::uint8_t coarse) {
    const Surface& surface = scene_.surfaces[surface_index];
    side_size_ = coarsening(coarse);
    for (const Polygon& piece : limited(block_pieces(surface.corners, mesh_.lines, tolerance_), max_group_corners))
      add_group(piece, surface_index, back, true);
  }

  /// A side that no light reaches: as few groups and elements as its corners allow, since nothing comes of them.
  void keep_dark_front(std::uint32_t surface_index) {
    side_size_ = std::numeric_limits<double>::infinity();
    for (const Polygon& piece : limited({scene_.surfaces[surface_index].corners}, max_group_corners))
      add_group(piece, surface_index, false, false);
  }

 private:
  /// Places nearer to each other than a millionth of this are one (m): the scene, or some hundred blocks where it is far larger.
  static double detail_of(const Mesh& mesh, const Box& box) {
    constexpr double patches = 256;
    return std::min(max_channel(box.size()), patches * mesh.options.patch_size);
  }

  void add_group(Polygon polygon, std::uint32_t surface, bool back, bool lit) {
    if (area(polygon) <= tolerance_ * tolerance_) return;
    // Seen from the back the corners run clockwise: turn them round.
    if (back) std::reverse(polygon.begin(), polygon.end());
    const Surface& whole = scene_.surfaces[surface];
    const PlaneId plane_id = planes_.find_or_add(back ? -whole.normal : whole.normal, whole.corners[0], mesh_.planes);
    const Plane& plane = mesh_.planes[plane_id.value];
    Group group;
    group.plane = plane_id;
    group.surface = SurfaceId{surface};
    group.back = back;
    group.area = area(polygon);
    group.centre = centroid(polygon);
    for (const Vec3& c : polygon) group.radius = std::max(group.radius, glm::length(c - group.centre));
    for (int axis = 0; axis < 3; ++axis)  // a side lying on a line belongs to the block in front of it
      group.block[axis] = static_cast<std::uint16_t>(
          block_of(mesh_.lines[axis], group.centre[axis] + 2 * tolerance_ * plane.normal[axis]));
    group.polygon = add_polygon(polygon, plane);
    group.first_patch = static_cast<std::uint32_t>(mesh_.patches.size());
    const GroupId group_id{static_cast<std::uint32_t>(mesh_.groups.size())};

    Box block;
    for (int axis = 0; axis < 3; ++axis) {
      block.lo[axis] = mesh_.lines[axis][group.block[axis]];
      block.hi[axis] = mesh_.lines[axis][group.block[axis] + 1];
    }
    // In a block that finer sides have made small, a coarse one is a patch at least.
    const double block_size = max_channel(block.size()) / (mesh_.options.patch_size * (1 << halvings(mesh_.options)));
    size_ = lit ? std::clamp(2 * block_size, 1.0, side_size_) : side_size_;
    const int flat_axis = largest_axis(plane.normal);
    halve(polygon, flat_axis, block, halvings(mesh_.options), 0,
          [&](const Polygon& piece, std::uint8_t branch) { add_patch(piece, plane_id, group_id, group, branch); });
    group.patch_count = static_cast<std::uint32_t>(mesh_.patches.size()) - group.first_patch;
    if (group.patch_count == 0) return;
    mesh_.groups.push_back(group);
    mesh_.group_is_lit.push_back(lit);
  }

  static int largest_axis(const Vec3& normal) {
    int largest = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (exceeds(std::abs(normal[axis]), std::abs(normal[largest]))) largest = axis;
    return largest;
  }

  /// Cuts along the middle lines of a box, on the two axes the plane runs along, where the piece is long enough; and the quarters
  /// likewise, until it is done so many `times`.
  template <class AddPatch>
  void halve(const Polygon& polygon, int flat_axis, const Box& box, int times, std::uint8_t branch,
             AddPatch&& add) const {
    struct Piece {
      Polygon polygon;
      Box box;
    };
    const double patch = mesh_.options.patch_size * size_;
    std::vector<Piece> pieces{{polygon, box}};
    for (int axis = 0; axis < 3; ++axis) {
      if (axis == flat_axis) continue;
      double lo, hi;
      extent_along(polygon, axis, lo, hi);
      const double middle = 0.5 * (box.lo[axis] + box.hi[axis]);
      const auto half = [&](Polygon part, const Box& of, double sign) {
        Piece piece{std::move(part), of};
        (sign > 0 ? piece.box.lo : piece.box.hi)[axis] = middle;
        return piece;
      };
      const bool is_cut = hi - lo > 1.1 * patch && middle - lo >= 0.2 * patch && hi - middle >= 0.2 * patch;
      std::vector<Piece> cut;
      for (const Piece& piece : pieces) {
        if (!is_cut) {
          cut.push_back(half(piece.polygon, piece.box, lo + hi > 2 * middle ? 1.0 : -1.0));
          continue;
        }
        for (const double sign : {1.0, -1.0}) {
          Polygon part = clipped(piece.polygon, sign * axis_direction(axis), sign * middle, tolerance_);
          if (!part.empty()) cut.push_back(half(std::move(part), piece.box, sign));
        }
      }
      pieces = std::move(cut);
    }
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      if (times == 1)
        add(pieces[k].polygon, branch);
      else
        halve(pieces[k].polygon, flat_axis, pieces[k].box, times - 1,
              static_cast<std::uint8_t>(branch | k << 2 * (times - 2)), add);
    }
  }

  CornerRange add_polygon(const Polygon& polygon, const Plane& plane) {
    const CornerRange range{static_cast<std::uint32_t>(mesh_.corners.size()),
                            static_cast<std::uint32_t>(polygon.size())};
    for (const Vec3& corner : polygon) mesh_.corners.push_back(plane.coordinates(corner));
    return range;
  }

  void add_patch(const Polygon& polygon, PlaneId plane_id, GroupId group_id, const Group& group, std::uint8_t branch) {
    const Plane& plane = mesh_.planes[plane_id.value];
    const Surface& surface = scene_.surfaces[group.surface.value];
    Patch patch;
    patch.group = group_id;
    patch.plane = plane_id;
    patch.surface = group.surface;
    patch.back = group.back;
    patch.branch = branch;
    patch.area = area(polygon);
    if (patch.area <= tolerance_ * tolerance_) return;
    patch.centre = centroid(polygon);
    for (const Vec3& c : polygon) patch.radius = std::max(patch.radius, glm::length(c - patch.centre));
    patch.polygon = add_polygon(polygon, plane);
    patch.lo = Vec2{1e300}, patch.hi = Vec2{-1e300};
    for (const Vec2& c : mesh_.polygon(patch.polygon))
      patch.lo = glm::min(patch.lo, c), patch.hi = glm::max(patch.hi, c);
    choose_grid(patch, place_size(surface, patch.back));
    patch.first_element = static_cast<std::uint32_t>(mesh_.elements.size());
    // Whether a needle is a patch at all does not depend on how its places are divided.
    add_places(patch);
    if (mesh_.elements.size() == patch.first_element) return;
    divide(patch);
    place_count_ += std::size_t{shooting_columns(patch)} * shooting_rows(patch);
    patch.element_count = static_cast<std::uint32_t>(mesh_.elements.size()) - patch.first_element;
    patch.reflectance = mean_reflectance(patch, plane, surface);
    if (!patch.back) patch.exitance = std::numbers::pi * scene_.material_of(surface).radiance;
    mesh_.patches.push_back(patch);
  }

  /// Power times 1/π, channels summed (W/sr).
  double emitted_by(const Surface& surface) const {
    return surface.area * sum_channels(scene_.material_of(surface).radiance);
  }

  /// Of a place that shoots (m). The edges of a luminaire's shadows have as many steps as it has places: all luminaires together
  /// have some 256, by their power, however coarse the mesh is. Pieces of a large one, or one lamp of very many, need no own.
  double place_size(const Surface& surface, bool back) const {
    const double usual = usual_place_size(mesh_.options) * size_;
    const double emitted = back ? 0.0 : emitted_by(surface);
    if (!(emitted > 0)) return usual;
    constexpr double places_of_all = 256, worth_it = 4;
    const double places = places_of_all * emitted / emitted_;
    return places < worth_it ? usual : std::min(usual, std::sqrt(surface.area / places));
  }

  /// As many elements as the size asks for, at most 16 (one vector, one packet of rays), as square as that allows.
  /// @param element  m
  void choose_grid(Patch& patch, double element) const {
    const Vec2 size = patch.hi - patch.lo;
    const auto wanted = [&](double length) {
      return static_cast<int>(std::clamp(std::ceil(length / element - 0.25), 1.0, 16.0));
    };
    int columns = wanted(size.x), rows = wanted(size.y);
    while (columns * rows > 16) {
      if (rows == 1 || (columns > 1 && exceeds(size.y / rows, size.x / columns)))
        --columns;
      else
        --rows;
    }
    if (columns * rows > 8) fill_vector(size, columns, rows);
    patch.columns = static_cast<std::uint8_t>(columns);
    patch.rows = static_cast<std::uint8_t>(rows);
  }

  /// A patch that fills more than half a vector may as well fill it: empty lanes cost as much as full ones.
  static void fill_vector(const Vec2& size, int& columns, int& rows) {
    constexpr int grids[][2] = {{4, 4}, {5, 3}, {3, 5}, {8, 2}, {2, 8}, {16, 1}, {1, 16}};
    double best = 1e300;
    for (const auto& grid : grids) {
      const double ratio = (size.x / grid[0]) / (size.y / grid[1]);
      const double elongation = std::max(ratio, 1 / ratio);
      if (exceeds(best, elongation)) best = elongation, columns = grid[0], rows = grid[1];
    }
  }

  PlaceTree tree_of(std::size_t place) const {
    return place < mesh_.places.size() ? mesh_.places[place] : as_options_ask_;
  }

  /// Makes each place of a patch one element.
  void add_places(const Patch& patch) {
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) add_element(patch, column, row, 1);
  }

  /// Makes the elements of a patch anew where its places, which are its elements so far, are divided.
  void divide(Patch& patch) {
    const int columns = patch.columns, rows = patch.rows;
    int levels = 0;
    for (int k = 0; k < columns * rows; ++k)
      levels = std::max(levels, tree_of(place_count_ + static_cast<std::size_t>(k)).levels());
    if (levels == 0) return;
    mesh_.elements.resize(patch.first_element);
    patch.fineness = static_cast<std::uint8_t>(1 << levels);
    patch.columns = static_cast<std::uint8_t>(columns << levels);
    patch.rows = static_cast<std::uint8_t>(rows << levels);
    // Sixteen in a row become one vector of receivers: places go by tiles of 2x2, so that they are neighbours.
    constexpr int tile = 2;
    for (int top = 0; top < rows; top += tile)
      for (int left = 0; left < columns; left += tile)
        for (int row = top; row < std::min(top + tile, rows); ++row)
          for (int column = left; column < std::min(left + tile, columns); ++column)
            add_elements(patch, tree_of(place_count_ + static_cast<std::size_t>(row * columns + column)), {},
                         column << levels, row << levels, 1 << levels);
  }

  /// @param column  row, span: where the node lies in the patch's grid
  void add_elements(const Patch& patch, const PlaceTree& tree, const PlaceTree::Node& node, int column, int row,
                    int span) {
    if (!tree.is_divided(node)) {
      add_element(patch, column, row, span);
      return;
    }
    const int half = span / 2;
    for (const int down : {0, 1})
      for (const int right : {0, 1})
        add_elements(patch, tree, node.quarter(right, down), column + right * half, row + down * half, half);
  }

  void add_element(const Patch& patch, int column, int row, int span) {
    Element element;
    element.column = static_cast<std::uint8_t>(column), element.row = static_cast<std::uint8_t>(row);
    element.span = static_cast<std::uint8_t>(span);
    const Polygon2 piece = mesh_.element_polygon(patch, element);
    if (piece.empty()) return;
    const double piece_area = signed_area(piece);
    Vec2 lo, hi;
    mesh_.element_rectangle(patch, element, lo, hi);
    if (!(piece_area > 1e-9 * (hi.x - lo.x) * (hi.y - lo.y))) return;
    element.centre = centroid(std::span<const Vec2>(piece));
    element.area = static_cast<float>(piece_area);
    mesh_.elements.push_back(element);
  }

  Rgb mean_reflectance(const Patch& patch, const Plane& plane, const Surface& surface) const {
    const Material& material = scene_.material_of(surface);
    if (!material.texture || surface.texcoords.empty()) return material.reflectance;
    Rgb sum{0.0};
    double weight = 0;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Element& element = mesh_.elements[e];
      sum += static_cast<double>(element.area) * reflectance_at(scene_, surface, plane.point(element.centre));
      weight += element.area;
    }
    return sum / weight;
  }

  const Scene& scene_;
  Mesh& mesh_;
  PlaceTree as_options_ask_ = PlaceTree::uniform(base_levels(mesh_.options));
  std::size_t place_count_ = 0;      ///< of all patches so far
  double emitted_ = 0;               ///< by all, as emitted_by()
  double side_size_ = 1, size_ = 1;  ///< of patches and elements, in usual ones: of the side, and of the group
  double tolerance_;
  PlaneTable planes_;
};

/// Calls with the surface and the coarseness of each lit side.
template <class Visit>
void for_each_lit_side(const Scene& scene, std::span<const LitSides> lit, Visit&& visit) {
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.material_of(scene.surfaces[s]).finish == Finish::glass) continue;
    const LitSides sides = lit.empty() ? LitSides{} : lit[s];
    if (sides.front) visit(s, false, sides.front_coarse);
    if (sides.back) visit(s, true, sides.back_coarse);
  }
}

/// Area of all lit sides, in usual elements' worth (m²).
double lit_area(const Scene& scene, std::span<const LitSides> lit) {
  double total = 0;
  for_each_lit_side(scene, lit, [&](std::uint32_t s, bool, std::uint8_t coarse) {
    total += scene.surfaces[s].area / (coarsening(coarse) * coarsening(coarse));
  });
  return total;
}

/// Fills in the sizes that are not given.
void choose_sizes(const Scene& scene, std::span<const LitSides> lit, MeshOptions& options) {
  if (options.patch_size <= 0) {
    const double extent = max_channel(bounds(scene).size());
    const double total = std::max(lit_area(scene, lit), 1e-12 * extent * extent);
    options.patch_size =
        options.element_size > 0 ? 4 * options.element_size : 4 * std::sqrt(total / options.target_elements);
  }
  if (options.element_size <= 0) options.element_size = options.patch_size / 4;
}

double block_size(const MeshOptions& options) { return options.patch_size * (1 << halvings(options)); }

std::array<BlockWidths, 3> widths_of(const Scene& scene, std::span<const LitSides> lit, const MeshOptions& options) {
  const double block = block_size(options);
  return {BlockWidths(scene, lit, 0, block), BlockWidths(scene, lit, 1, block), BlockWidths(scene, lit, 2, block)};
}

/// @param options  with all sizes chosen
MeshForecast forecast_of(const Scene& scene, std::span<const LitSides> lit, const MeshOptions& options,
                         const std::array<BlockWidths, 3>& widths) {
  MeshForecast forecast;
  const Box box = bounds(scene);
  for (int axis = 0; axis < 3; ++axis)
    forecast.blocks = std::max(forecast.blocks, widths[axis].count(box.lo[axis], box.hi[axis]));
  for_each_lit_side(scene, lit, [&](std::uint32_t s, bool, std::uint8_t coarse) {
    const Surface& surface = scene.surfaces[s];
    const double element = options.element_size * coarsening(coarse);
    // A plane is cut by the lines of two axes, and by those of the third where it leans.
    std::array<double, 3> blocks;
    for (int axis = 0; axis < 3; ++axis) {
      double lo, hi;
      extent_along(surface.corners, axis, lo, hi);
      blocks[axis] = widths[axis].count(lo, hi);
    }
    std::sort(blocks.begin(), blocks.end());
    const double pieces = (blocks[0] + blocks[1]) * blocks[2], elements_of_piece = coarse > 0 ? 4 : 1;
    forecast.elements += std::max(surface.area / (element * element), elements_of_piece * pieces);
  });
  return forecast;
}

}  // namespace

Polygon2 Mesh::element_polygon(const Patch& patch, const Element& element) const {
  Vec2 lo, hi;
  element_rectangle(patch, element, lo, hi);
  const std::span<const Vec2> whole = polygon(patch.polygon);
  Polygon2 piece(whole.begin(), whole.end());
  // Only along lines inside the patch, so that its own corners stay where they are.
  const double slack = 1e-9 * (hi.x - lo.x + hi.y - lo.y);
  const auto cut = [&](bool inside, const Vec2& normal, double offset) {
    if (inside && !piece.empty()) piece = clipped(piece, normal, offset, slack);
  };
  cut(element.column > 0, {1, 0}, lo.x);
  cut(element.column + element.span < patch.columns, {-1, 0}, -hi.x);
  cut(element.row > 0, {0, 1}, lo.y);
  cut(element.row + element.span < patch.rows, {0, -1}, -hi.y);
  return piece;
}

std::vector<PlaceTree> places_of(const Mesh& mesh) {
  std::vector<PlaceTree> places;
  for (const Patch& patch : mesh.patches) {
    const std::size_t first = places.size();
    places.resize(first + std::size_t{shooting_columns(patch)} * shooting_rows(patch));
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const PlaceTree::Node node = node_of(patch, mesh.elements[e]);
      if (node.level > 0) places[first + shooting_place(patch, mesh.elements[e])].divide(node.parent());
    }
  }
  return places;
}

MeshForecast forecast_of(const Scene& scene, const MeshOptions& options, std::span<const LitSides> lit) {
  MeshOptions chosen = options;
  choose_sizes(scene, lit, chosen);
  return forecast_of(scene, lit, chosen, widths_of(scene, lit, chosen));
}

namespace {

/// @param options  with all sizes chosen
Mesh cut_mesh(const Scene& scene, const MeshOptions& options, std::span<const LitSides> lit,
              std::span<const PlaceTree> places) {
  Mesh mesh;
  mesh.options = options;
  mesh.lit_sides.assign(lit.begin(), lit.end());
  mesh.places.assign(places.begin(), places.end());
  const std::array<BlockWidths, 3> widths = widths_of(scene, lit, options);
  const Box box = bounds(scene);
  for (int axis = 0; axis < 3; ++axis) mesh.lines[axis] = block_lines(scene, box, axis, widths[axis]);

  Cutter cutter(scene, mesh, box);
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.material_of(scene.surfaces[s]).finish == Finish::glass) continue;
    const LitSides sides = lit.empty() ? LitSides{} : lit[s];
    if (sides.front)
      cutter.cut_side(s, false, sides.front_coarse);
    else
      cutter.keep_dark_front(s);
    if (sides.back) cutter.cut_side(s, true, sides.back_coarse);
  }
  return mesh;
}

void enlarge(MeshOptions& options, double factor) { options.patch_size *= factor, options.element_size *= factor; }

/// Lets sizes grow until the forecast holds.
void grow_to_forecast(const Scene& scene, std::span<const LitSides> lit, MeshOptions& options) {
  for (int most_rounds = 16; most_rounds > 0; --most_rounds) {
    const MeshForecast forecast = forecast_of(scene, lit, options, widths_of(scene, lit, options));
    const double too_many =
        std::max(std::sqrt(forecast.elements / (1.5 * options.target_elements)), forecast.blocks / most_blocks);
    if (too_many <= 1) return;
    enlarge(options, 1.01 * too_many);
  }
}

/// On sides whose elements are not coarse.
std::size_t usual_elements(const Mesh& mesh) {
  std::size_t count = 0;
  for (const Patch& patch : mesh.patches) {
    const LitSides sides = mesh.lit_sides.empty() ? LitSides{} : mesh.lit_sides[patch.surface.value];
    if ((patch.back ? sides.back_coarse : sides.front_coarse) == 0) count += patch.element_count;
  }
  return count;
}

/// Block lines along walls and furniture make more elements than area alone would. So sizes grow, by as much as area should need; a
/// size that does not bring fewer is not taken: many small faces stay as many.
void grow_to_target(const Scene& scene, std::span<const LitSides> lit, Mesh& mesh) {
  constexpr double enough = 1.25, cautious = 0.6, least_step = 1.05, most_growth = 1.35;
  MeshOptions options = mesh.options;
  for (int most_rounds = 4; most_rounds > 0; --most_rounds) {
    const double too_many = static_cast<double>(usual_elements(mesh)) / options.target_elements;
    if (too_many <= enough) return;
    enlarge(options, std::max(1 + cautious * (std::sqrt(too_many) - 1), least_step));
    if (options.patch_size > most_growth * mesh.options.patch_size) return;
    if (Mesh coarser = cut_mesh(scene, options, lit, {}); coarser.elements.size() < mesh.elements.size())
      mesh = std::move(coarser);
  }
}

}  // namespace

Mesh mesh_of(const Scene& scene, const MeshOptions& options, std::span<const LitSides> lit,
             std::span<const PlaceTree> places) {
  MUST(!scene.surfaces.empty());
  MUST(lit.empty() || lit.size() == scene.surfaces.size());
  MeshOptions chosen = options;
  choose_sizes(scene, lit, chosen);
  const bool is_chosen_here = options.patch_size <= 0 && options.element_size <= 0;
  if (is_chosen_here) grow_to_forecast(scene, lit, chosen);
  Mesh mesh = cut_mesh(scene, chosen, lit, places);
  if (is_chosen_here && places.empty()) grow_to_target(scene, lit, mesh);
  return mesh;
}

}  // namespace lichthof
