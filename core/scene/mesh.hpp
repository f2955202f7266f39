/// The mesh of a scene: surfaces cut by a rectilinear grid into groups, patches and elements.
///
/// A *group* is the piece of one surface side inside one block of the grid; cells are unions of blocks, so a group lies in
/// exactly one cell whatever the topology (§2: "the same mesh can be used with different cell topologies"). It shoots as one
/// towards receivers far away. A *patch* shoots; it is a group halved along the middle lines of its block, and again along those
/// of the halves where patches are of few elements: a group is about 8x8 elements whatever their size, so up to 8x8 patches.
/// *Elements* receive: a patch has up to 16, a grid of its bounding rectangle clipped to its polygon; luminaires more than others
/// where the mesh is coarse, for the edges of their shadows. Where
/// the light asks for it (core/light/refinement) they are divided by quadtrees (core/scene/place_tree) into as many as 8x8: the patch
/// receives in more places, and shoots from its 16 as before, so that fine receivers cost no finer shooters.
/// Group, patch and element are all convex polygons of one plane.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/types.hpp"
#include "core/scene/block_lines.hpp"
#include "core/scene/place_tree.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// An oriented plane that at least one surface side lies on. Coplanar sides that face the same way share it, whatever
/// their material, so irradiance can be interpolated across them.
struct Plane {
  Vec3 origin;  ///< a point of the plane (m)
  Vec3 u, v;    ///< unit, right-handed with `normal`; along the grid's axes where the plane allows it
  Vec3 normal;  ///< unit, towards the side that is lit
  Vec3 point(const Vec2& p) const { return origin + p.x * u + p.y * v; }
  Vec2 coordinates(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {glm::dot(d, u), glm::dot(d, v)};
  }
};

/// Range of Mesh::corners: a convex polygon in plane coordinates, counter-clockwise seen from the lit side.
struct CornerRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

struct Group {
  PlaneId plane;
  SurfaceId surface;
  bool back = false;  ///< it is the back of its surface
  std::uint32_t first_patch = 0;
  std::uint32_t patch_count = 0;  ///< 1..64
  CornerRange polygon;
  double area = 0;                       ///< m²
  double radius = 0;                     ///< m; largest distance of a corner from the centre
  Vec3 centre;                           ///< centre of gravity (m)
  std::array<std::uint16_t, 3> block{};  ///< index of the block along x, y, z
};

struct Patch {
  GroupId group;
  PlaneId plane;
  SurfaceId surface;
  bool back = false;
  /// Which of the group's quarters it lies in, times 4, and which quarter of that: in ascending order within the group, 0 where
  /// it has no such.
  std::uint8_t branch = 0;
  std::uint8_t columns = 1, rows = 1;  ///< of its smallest elements
  std::uint8_t fineness = 1;  ///< 1, 2, 4 or 8: of the smallest elements on each side of a place; places shoot, 16 at most
  std::uint32_t first_element = 0;
  std::uint32_t element_count = 0;  ///< ≤ columns * rows; empty ones are left out
  CornerRange polygon;
  Vec2 lo, hi;           ///< bounding rectangle in plane coordinates (m)
  double area = 0;       ///< m²
  double radius = 0;     ///< m
  Vec3 centre;           ///< m
  Rgb reflectance{0.0};  ///< mean over the patch, texture included
  Rgb exitance{0.0};     ///< π Ke on the front (W/m²), 0 on the back
};

struct Element {
  Vec2 centre;     ///< centre of gravity in plane coordinates (m)
  float area = 0;  ///< m²
  std::uint8_t column = 0, row = 0;  ///< of its low corner in the patch's grid
  std::uint8_t span = 1;             ///< 1, 2, 4 or 8: columns and rows of that grid it takes
};

/// Places of the grid a patch shoots from.
inline std::uint32_t shooting_columns(const Patch& patch) {
  return static_cast<std::uint32_t>(patch.columns / patch.fineness);
}
inline std::uint32_t shooting_rows(const Patch& patch) {
  return static_cast<std::uint32_t>(patch.rows / patch.fineness);
}
inline std::size_t shooting_place(const Patch& patch, const Element& element) {
  return std::size_t{element.row} / patch.fineness * shooting_columns(patch) + element.column / patch.fineness;
}

/// An element in the tree of its place.
inline PlaceTree::Node node_of(const Patch& patch, const Element& element) {
  PlaceTree::Node node;
  while (element.span << node.level < patch.fineness) ++node.level;
  node.column = element.column % patch.fineness / element.span, node.row = element.row % patch.fineness / element.span;
  return node;
}

struct MeshOptions {
  double patch_size = 0;    ///< m, of usual sides; 0: chosen from the scene's area so that about `target_elements` arise
  double element_size = 0;  ///< m; 0: a quarter of the patch size
  std::uint32_t target_elements = 12000;
};

struct Mesh {
  MeshOptions options;                       ///< with the sizes that were really used
  std::array<std::vector<double>, 3> lines;  ///< block lines along x, y, z, ascending (m); cell boundaries lie on these
  std::vector<Plane> planes;
  std::vector<Group> groups;
  std::vector<Patch> patches;              ///< those of a group are contiguous
  std::vector<Element> elements;           ///< those of a patch are contiguous
  std::vector<Vec2> corners;               ///< pool of all polygons
  std::vector<std::uint8_t> group_is_lit;  ///< 0: dormant, light can not get there
  // What mesh_of() was given: the mesh follows from these, the scene and `options`.
  std::vector<LitSides> lit_sides;
  std::vector<PlaceTree> places;  ///< of the places of all patches, row by row; empty: all alike, as `options` ask

  std::span<const Vec2> polygon(const CornerRange& range) const { return {corners.data() + range.first, range.count}; }
  /// Rectangle of an element in plane coordinates, before clipping to the patch.
  void element_rectangle(const Patch& patch, const Element& element, Vec2& lo, Vec2& hi) const {
    const Vec2 size = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
    lo = patch.lo + size * Vec2{element.column, element.row};
    hi = lo + size * static_cast<double>(element.span);
  }
  /// What the patch leaves of that rectangle; empty where it leaves nothing.
  Polygon2 element_polygon(const Patch& patch, const Element& element) const;
};

/// What a mesh would be like, before anything is taken for it.
struct MeshForecast {
  double elements = 0;  ///< that are lit; within a factor of two, 16 for each small face more
  double blocks = 0;    ///< along the axis that has most
};
/// Numbers of blocks are 16 bits.
inline constexpr double most_blocks = 60000;

/// Where a size is 0, for the size that mesh_of() begins with.
MeshForecast forecast_of(const Scene& scene, const MeshOptions& options, std::span<const LitSides> lit);

/// Cuts a scene. Glass gets no patches: light passes it. Sides that are coarse get elements so many times as large, in blocks as
/// wide where nothing finer is near. Where the size is chosen here, it is so large that blocks bring no more than half as
/// many elements as were wanted on top of those. A dark front is one group of one element, in as many cells as it may reach.
/// @pre forecast_of(): not more than most_blocks, where a size is given
/// @param lit  one entry per surface, or empty for "everything may be lit"
/// @param places  how the places of all patches are divided, row by row (the patches are the same however that is), or empty: as the
///                sizes in `options` ask
/// @cost  O(patches), about 1 µs each
/// @source paper §2 (grids projected onto every surface)
Mesh mesh_of(const Scene& scene, const MeshOptions& options, std::span<const LitSides> lit,
             std::span<const PlaceTree> places = {});

/// How the places of a mesh are divided, also where that follows from its options.
std::vector<PlaceTree> places_of(const Mesh& mesh);

}  // namespace lichthof
