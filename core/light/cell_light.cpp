#include "core/light/cell_light.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/check.hpp"
#include "core/light/bit_projector.hpp"
#include "core/light/cell_surfaces.hpp"
#include "core/light/openness.hpp"
#include "core/light/radiosity.hpp"
#include "core/light/raycast.hpp"
#include "core/light/receiver_tree.hpp"
#include "core/light/shadows.hpp"
#include "core/light/transfer.hpp"
#include "core/light/visibility_cache.hpp"

namespace lichthof {

Rgb Shot::power() const {
  Rgb power{0.0};
  for (const ShotPatch& patch : patches)
    for (std::size_t k = 0; k < patch.area.size(); ++k)
      power += static_cast<double>(patch.area[k]) * Rgb{patch.delta[k]};
  return power;
}

std::size_t Shot::wire_bytes() const {
  // As the wire form counts: 32-bit floats for values, 64-bit ones for places.
  std::size_t bytes = 8 + 8 + 4 + 4 * 24 + 24 + 8 + 8 + 16 * corners.size();
  for (const ShotPatch& patch : patches) bytes += 3 + 32 + 24 + 16 * patch.corners.size() + 20 * patch.delta.size();
  return bytes;
}

namespace {

/// Where the hemicube stands: the centre of what is open, unless it is dark there. The centre of a floor patch may lie under a
/// cabinet; a hemicube in there would hide the whole shot from all other cells.
Vec3 hemicube_centre(const Shot& shot) {
  struct Place {
    Vec2 centre;
    double open_area, area;
  };
  std::vector<Place> places;
  Vec2 middle{0.0};
  double open_sum = 0, area_sum = 0;
  for (const ShotPatch& patch : shot.patches) {
    const Vec2 step = (patch.hi - patch.lo) / Vec2{patch.columns, patch.rows};
    for (std::size_t k = 0; k < patch.area.size(); ++k) {
      if (patch.area[k] <= 0) continue;
      const Vec2 centre =
          patch.lo +
          step * (Vec2{static_cast<double>(k % patch.columns), static_cast<double>(k / patch.columns)} + 0.5);
      places.push_back({centre, patch.openness[k] * patch.area[k], patch.area[k]});
      middle += places.back().open_area * centre;
      open_sum += places.back().open_area;
      area_sum += patch.area[k];
    }
  }
  if (!(open_sum > 0)) return shot.centre;
  middle /= open_sum;
  const Place* nearest = nullptr;       // of all places
  const Place* nearest_open = nullptr;  // of those at least half as open as the mean
  const auto nearer = [&](const Place& a, const Place* b) {
    return !b || glm::dot(a.centre - middle, a.centre - middle) < glm::dot(b->centre - middle, b->centre - middle);
  };
  for (const Place& place : places) {
    if (nearer(place, nearest)) nearest = &place;
    if (place.open_area * area_sum >= 0.5 * open_sum * place.area && nearer(place, nearest_open)) nearest_open = &place;
  }
  return shot.plane.point(nearest == nearest_open || !nearest_open ? middle : nearest_open->centre);
}

/// Covers what the surface covers of what lies beyond a side of the box, by its part before that.
void project_before(const HemicubeFrame& frame, const CoveringSurface& surface, const Box& box, int side,
                    HemicubeBitmap& bitmap) {
  const int axis = side / 2;
  const bool is_low = side % 2 == 0;
  if (is_low ? surface.bounds.lo[axis] >= box.lo[axis] : surface.bounds.hi[axis] <= box.hi[axis])
    return project(frame, surface.corners, bitmap);
  Vec3 inwards{0.0};
  inwards[axis] = is_low ? 1 : -1;
  const Polygon part = clipped(surface.corners, inwards, is_low ? box.lo[axis] : -box.hi[axis], 0.0);
  if (!part.empty()) project(frame, part, bitmap);
}

}  // namespace

struct CellLight::Impl {
  Impl(std::shared_ptr<const Scene> scene_, std::shared_ptr<const Mesh> mesh_, const std::vector<GroupId>& groups,
       const Box& box_, const TransferOptions& options_, std::shared_ptr<const Parallel> parallel_,
       std::shared_ptr<const GroupExchange> exchange_)
      : scene(std::move(scene_)), mesh(std::move(mesh_)), options(options_), parallel(std::move(parallel_)), box(box_),
        rim(mesh->options.patch_size), own(surfaces_of(*scene, box, rim)), surfaces(own ? *own : scene->surfaces),
        covering(own ? covering_surfaces(*scene, surfaces, box, rim) : std::vector<CoveringSurface>{}),
        origin(local_origin()), tree(receiver_tree(*mesh, lit_groups(groups), origin)),
        rays(*scene, surfaces, origin, Glass::clear), occluders(*scene, surfaces, origin, rays.offset()),
        exchange(exchange_ ? std::move(exchange_) : std::make_shared<const GroupExchange>(*scene, *mesh, *parallel)),
        light(*mesh, tree, *exchange),
        outlines(*mesh, options.method == TransferMethod::hemicube ? std::span(groups) : std::span<const GroupId>{}),
        answers(options.visibility_cache_bytes) {
    double area = 0;
    for (const Patch& patch : mesh->patches) area += patch.area;
    reach = reach_of(area, options);
    set_light(tree, *exchange);
    hulls_pay = hulls_are_clear();
    std::vector<Vec3> shining;
    for (const Surface& surface : surfaces)
      shining.push_back(scene->material_of(surface).emits() ? surface.normal : Vec3{0.0});
    find_openness(tree, rays, shining, mesh->options.patch_size, *parallel);
    largest_initial_power = power_of_strongest_luminaire(*mesh, mesh_groups(tree));
  }

  /// Whether occluders between shooters and receivers are so few that it pays to search for them: most hulls of a crowded scene
  /// hold more than is worth looking at. Pairs of groups and islands all over the cell tell.
  bool hulls_are_clear() const {
    constexpr std::size_t most_groups = 64, most_islands = 8;
    // Cornell 1, two_rooms .73: pays; office .02, office_floor .2: even; courtyard .002: costs a tenth.
    constexpr double share_that_pays = 0.1;
    const std::size_t groups = std::min(most_groups, tree.groups.size()),
                      islands = std::min(most_islands, tree.islands.size());
    std::size_t clear = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      const Group& group = mesh->groups[tree.groups[g * tree.groups.size() / groups].mesh_group];
      const Plane& plane = mesh->planes[group.plane.value];
      std::vector<Vec3> corners;
      for (const Vec2& corner : mesh->polygon(group.polygon)) corners.push_back(plane.point(corner));
      const ShadowShooter shooter(flat_shooter(corners, plane.normal, origin), occluders, true);
      for (std::size_t i = 0; i < islands; ++i) {
        const ReceiverNode& node =
            tree.nodes[tree.islands[(i * tree.islands.size() + g) / islands % tree.islands.size()]];
        const Shaft hull = shaft_between(shooter.box, box_of(node), static_cast<float>(rays.offset()));
        clear += occluders.in_shaft(hull, shooter.sides, Shadows::few_occluders).complete;
      }
    }
    return static_cast<double>(clear) > share_that_pays * static_cast<double>(groups * islands);
  }

  std::vector<GroupId> lit_groups(std::vector<GroupId> groups) const {
    std::erase_if(groups, [&](GroupId id) { return !mesh->group_is_lit[id.value]; });
    return groups;
  }

  Vec3 local_origin() const {
    Box bounds;
    for (const Surface& surface : surfaces)
      for (const Vec3& corner : surface.corners) bounds.include(corner);
    return surfaces.empty() ? Vec3{0.0} : bounds.centre();
  }

  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Mesh> mesh;
  TransferOptions options;
  std::shared_ptr<const Parallel> parallel;
  Box box;
  double rim = 0;  ///< m; see core/light/cell_surfaces
  std::optional<std::vector<Surface>> own;
  std::span<const Surface> surfaces;
  std::vector<CoveringSurface> covering;  ///< none where there are no other cells
  Vec3 origin;
  ReceiverTree tree;
  RayScene rays;
  Occluders occluders;
  std::shared_ptr<const GroupExchange> exchange;
  Radiosity light;
  ElementOutlines outlines;
  VisibilityCache answers;
  double largest_initial_power = 0;
  float reach = 0;  ///< of shots, see core/light/transfer

  bool hulls_pay = true;  ///< whether shadows search hulls for occluders, see core/light/shadows
};

CellLight::CellLight(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh, std::vector<GroupId> groups,
                     const Box& box, const TransferOptions& options, std::shared_ptr<const Parallel> parallel,
                     std::shared_ptr<const GroupExchange> exchange) {
  impl_ = std::make_unique<Impl>(std::move(scene), std::move(mesh), groups, box, options, std::move(parallel),
                                 std::move(exchange));
}

CellLight::~CellLight() = default;
CellLight::CellLight(CellLight&&) noexcept = default;

CellLight::Candidate CellLight::strongest() const { return impl_->light.strongest(); }
double CellLight::largest_initial_power() const { return impl_->largest_initial_power; }

Shot CellLight::take_shot(GroupId group_id, ShotId id, SceneVersion version) {
  const Mesh& mesh = *impl_->mesh;
  const Group& group = mesh.groups[group_id.value];
  const std::uint32_t local = impl_->light.local_group_of()[group_id.value];
  MUST(local != ~0u);
  Shot shot;
  shot.id = id;
  shot.version = version;
  shot.group = group_id;
  shot.plane = mesh.planes[group.plane.value];
  const std::span<const Vec2> outline = mesh.polygon(group.polygon);
  shot.corners.assign(outline.begin(), outline.end());
  shot.centre = group.centre;
  shot.radius = group.radius;
  shot.area = group.area;
  shot.patches.resize(group.patch_count);
  for (std::uint32_t k = 0; k < group.patch_count; ++k) {
    const Patch& patch = mesh.patches[group.first_patch + k];
    ShotPatch& out = shot.patches[k];
    const std::span<const Vec2> corners = mesh.polygon(patch.polygon);
    out.corners.assign(corners.begin(), corners.end());
    out.branch = patch.branch;
    out.columns = static_cast<std::uint8_t>(shooting_columns(patch));
    out.rows = static_cast<std::uint8_t>(shooting_rows(patch));
    out.lo = patch.lo, out.hi = patch.hi;
    out.delta.assign(std::size_t{out.columns} * out.rows, Rgbf{0.f});
    out.area.assign(out.delta.size(), 0.f);
    out.openness.assign(out.delta.size(), 0.f);
  }
  impl_->light.take(local, shot);
  impl_->light.note_change();
  shot.centre = hemicube_centre(shot);
  return shot;
}

TransferWork CellLight::receive(const Shot& shot, const HemicubeBitmap* incoming) {
  // A foreign shot's packets depend on its bitmap, which stands where that shot's light is: its answers are its own.
  VisibilityCache* const answers = incoming ? nullptr : &impl_->answers;
  const TransferScene scene{*impl_->mesh,     impl_->tree,      impl_->rays,   impl_->occluders,
                            impl_->outlines,  impl_->options,   impl_->origin, impl_->reach,
                            *impl_->exchange, impl_->hulls_pay, answers};
  const TransferWork work = transfer(shot, incoming, scene, impl_->light, *impl_->parallel);
  impl_->light.note_change();
  return work;
}

std::vector<Passage> CellLight::project(const Shot& shot, std::span<const NextCell> next,
                                        const HemicubeBitmap& bitmap) const {
  const HemicubeFrame frame = shot.frame();
  const auto is_of_shooter = [&](const CoveringSurface& surface) {  // whose plane rounding may lift over its centre
    const double height = glm::dot(shot.plane.normal, surface.corners[0] - shot.centre);
    return std::abs(glm::dot(shot.plane.normal, surface.normal)) > 1 - 1e-9 && std::abs(height) < impl_->rays.offset();
  };
  const auto counts = [&](const CoveringSurface& surface, const Box& reach) {
    return !can_not_shadow(surface.corners[0], surface.normal, shot.centre, reach);
  };
  // What lies wholly outside is another cell's to show, but where the shot comes in: that cell has left it to this one.
  const auto is_elsewhere = [&](const CoveringSurface& surface) {
    for (int axis = 0; axis < 3; ++axis)
      if ((surface.bounds.lo[axis] > impl_->box.hi[axis] && !(shot.centre[axis] > impl_->box.hi[axis])) ||
          (surface.bounds.hi[axis] < impl_->box.lo[axis] && !(shot.centre[axis] < impl_->box.lo[axis])))
        return true;
    return false;
  };
  // Item buffers show the patches of their cell and nothing around it.
  const bool traces = impl_->options.method != TransferMethod::hemicube;
  const auto is_left_to = [&](const NextCell& cell, const CoveringSurface& surface) {
    return traces && concerns(surface.bounds, cell.box, impl_->rim);
  };
  Box beyond;
  for (const NextCell& cell : next) beyond.include(cell.reach.lo), beyond.include(cell.reach.hi);
  // Most surfaces are the same for all.
  HemicubeBitmap common = bitmap;
  std::vector<const CoveringSurface*> others;
  for (const CoveringSurface& surface : impl_->covering) {
    if (is_elsewhere(surface) || is_of_shooter(surface) || !counts(surface, beyond)) continue;
    if (impl_->box.contains(surface.bounds.lo) && impl_->box.contains(surface.bounds.hi) &&
        std::ranges::none_of(next, [&](const NextCell& cell) { return is_left_to(cell, surface); }))
      lichthof::project(frame, surface.corners, common);
    else
      others.push_back(&surface);
  }
  std::vector<Passage> passages(next.size(), {common, {}});
  for (std::size_t k = 0; k < next.size(); ++k) {
    HemicubeBitmap& passed = passages[k].bitmap;
    const int side = side_towards(impl_->box, next[k].box);
    std::vector<const CoveringSurface*> walls;
    for (const CoveringSurface* surface : others) {
      if (!counts(*surface, next[k].reach)) continue;
      if (!is_left_to(next[k], *surface))
        // What reaches past the side elsewhere is not nearer there than the next cell.
        project_before(frame, *surface, impl_->box, side, passed);
      else if (surface->closes >> side & 1)
        walls.push_back(surface);
    }
    if (!walls.empty()) passages[k].walled = passed;
    for (const CoveringSurface* wall : walls) lichthof::project(frame, wall->corners, passages[k].walled);
  }
  return passages;
}

void CellLight::set_emission(std::uint32_t material, const Rgb& radiance) {
  Impl& i = *impl_;
  for (std::uint32_t g = 0; g < i.tree.groups.size(); ++g) {
    const GroupPlace& place = i.tree.groups[g];
    for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
      const Patch& patch = i.mesh->patches[i.tree.patches[p].mesh_patch];
      if (!patch.back && i.scene->surfaces[patch.surface.value].material == material)
        i.light.patches[p].exitance = 3.14159265358979323846 * radiance;
    }
    i.light.update_group(g);
  }
  i.light.note_change();
}

void CellLight::set_reflectance(std::uint32_t material, const Rgb& reflectance) {
  Impl& i = *impl_;
  const Rgb before = i.scene->materials[material].reflectance;
  for (std::uint32_t g = 0; g < i.tree.groups.size(); ++g) {
    const GroupPlace& place = i.tree.groups[g];
    for (std::uint32_t p = place.first_patch; p < place.first_patch + place.patch_count; ++p) {
      const Patch& patch = i.mesh->patches[i.tree.patches[p].mesh_patch];
      if (i.scene->surfaces[patch.surface.value].material != material) continue;
      // A texture multiplies: its mean over the patch is what the mesh holds over the plain reflectance.
      for (int c = 0; c < 3; ++c) {
        const double texture = before[c] > 0 ? patch.reflectance[c] / before[c] : 1.0;
        i.light.patches[p].reflectance[c] = reflectance[c] * texture;
      }
    }
    i.light.update_group(g);
  }
  i.light.note_change();
}

CellPower CellLight::power() const { return impl_->light.power(); }

void CellLight::store(Solution& solution) const {
  for (std::size_t k = 0; k < impl_->tree.clusters.size(); ++k) {
    const Cluster& cluster = impl_->tree.clusters[k];
    const ClusterLight& light = impl_->light.clusters[k];
    for (int lane = 0; lane < 16; ++lane) {
      if (!((cluster.lanes >> lane) & 1)) continue;
      const std::uint32_t e = cluster.element[lane];
      for (int c = 0; c < 3; ++c) {
        solution.irradiance[e][c] = light.received.value[c][lane];
        solution.direct_irradiance[e][c] = light.direct.value[c][lane];
        solution.shot[e][c] = light.shot[c][lane];
      }
    }
  }
}

void CellLight::load(const Solution& solution) {
  Impl& i = *impl_;
  for (std::size_t k = 0; k < i.tree.clusters.size(); ++k) {
    const Cluster& cluster = i.tree.clusters[k];
    ClusterLight& light = i.light.clusters[k];
    for (int lane = 0; lane < 16; ++lane) {
      if (!((cluster.lanes >> lane) & 1)) continue;
      const std::uint32_t e = cluster.element[lane];
      PatchLight& patch = i.light.patches[cluster.first_patch + cluster.patch[lane]];
      const double area = cluster.area[lane];
      for (int c = 0; c < 3; ++c) {
        light.received.value[c][lane] = solution.irradiance[e][c];
        light.direct.value[c][lane] = solution.direct_irradiance[e][c];
        light.shot[c][lane] = solution.shot[e][c];
      }
      patch.received_w += area * Rgb{solution.irradiance[e]};
      patch.shot_w += area * Rgb{solution.shot[e]};
      // A luminaire's first shot carries its whole emission, so S ≠ 0 means that the emission is out.
      if (solution.shot[e] != Rgbf{0.f}) patch.emission_shot = patch.exitance;
    }
  }
  for (std::uint32_t g = 0; g < i.tree.groups.size(); ++g) i.light.update_group(g);
  i.light.note_change();
}

std::size_t CellLight::memory_bytes() const {
  const Impl& i = *impl_;
  std::size_t bytes = i.tree.memory_bytes() + i.light.memory_bytes() + i.rays.memory_bytes() +
                      i.occluders.memory_bytes() + bytes_of(i.outlines.outlines());
  if (i.own) {
    bytes += bytes_of(*i.own);
    for (const Surface& surface : *i.own) bytes += bytes_of(surface.corners);
    bytes += bytes_of(i.covering);
  }
  for (const ElementOutlines::Outline& outline : i.outlines.outlines()) bytes += outline.corners.size() * sizeof(Vec3);
  return bytes + i.answers.bytes();
}

}  // namespace lichthof
