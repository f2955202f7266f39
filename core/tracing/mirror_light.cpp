#include "core/tracing/mirror_light.hpp"

#include "core/light/form_factor.hpp"
#include "core/light/one_cell.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/mirror_images.hpp"
#include "core/tracing/scattering.hpp"
#include "core/tracing/shining_place.hpp"

namespace lichthof {

namespace {

constexpr std::uint32_t rays_per_image = 4, rays_per_mirror = 16;
/// What surfaces show by way of a mirror is a few per cent of all light: some per cent of that are known from few elements. What
/// they get that way themselves is left out of it: going round twice costs as much again, for .15 % in a room with a large mirror.
constexpr std::uint32_t coarse_elements = 3000;
constexpr double coarse_eps = 1e-3;
/// With more mirrors the search would cost more than it gives, and what they show of surfaces is left out.
constexpr std::size_t most_mirrors = 256;
constexpr int most_mirrors_in_a_row = 4;

/// A side that reflects.
struct MirrorSide {
  std::uint32_t surface = 0;
  Vec3 normal;
  Polygon corners;  ///< counter-clockwise for those before it
};

std::vector<MirrorSide> mirror_sides(const Scene& scene) {
  std::vector<MirrorSide> sides;
  for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (!is_mirror(scene.material_of(surface))) continue;
    sides.push_back({s, surface.normal, surface.corners});
    sides.push_back({s, -surface.normal, Polygon(surface.corners.rbegin(), surface.corners.rend())});
  }
  return sides;
}

/// Radiosity that surfaces reflect into a ray which leaves a mirror, by way of further mirrors too (W/m²).
Rgb reflected_into(const LitScene& lit, Vec3 from, Vec3 direction) {
  const TraceScene& trace = lit.trace();
  Rgb share{1.0};
  for (int mirrors = 1; mirrors <= most_mirrors_in_a_row; ++mirrors) {
    const std::optional<Hit> hit = trace.clear_rays().nearest(from, direction);
    if (!hit) break;
    const SurfacePoint at = trace.surface_point(hit->surface, hit->front, from + hit->distance * direction);
    const Surface& surface = trace.scene().surfaces[at.surface];
    const Material& material = trace.scene().material_of(surface);
    share *= trace.transmittance(from, at.point);
    if (material.finish != Finish::mirror) return share * lit.reflected_radiosity(at, glm::length(at.point - from));
    share *= specular_share(material, reflectance_at(trace.scene(), surface, at.point));
    direction = mirrored(direction, at.normal);
    from = trace.lifted(at);
  }
  return Rgb{0.0};
}

/// Irradiance at a point by what mirrors show of surfaces, luminaires' own light left out (W/m²).
Rgb shown_by_mirrors(const LitScene& lit, const std::vector<MirrorSide>& sides, const Vec3& point, const Vec3& normal,
                     Random& random) {
  const TraceScene& trace = lit.trace();
  const double lift = trace.offset();
  const Vec3 start = point + lift * normal;
  Rgb sum{0.0};
  for (const MirrorSide& side : sides) {
    if (glm::dot(side.normal, point - side.corners[0]) <= 2 * lift) continue;
    const double factor = form_factor(point, normal, side.corners);
    if (!(factor > 0)) continue;
    const Surface& surface = trace.scene().surfaces[side.surface];
    const Material& material = trace.scene().material_of(surface);
    const Vec3 middle = centroid(std::span<const Vec3>(side.corners));
    const double whole = area(std::span<const Vec3>(side.corners));
    Rgb seen{0.0};
    for (std::uint32_t ray = 0; ray < rays_per_mirror; ++ray) {
      const Vec3 place = shining_place(side.corners, whole, side.normal, point, normal, middle, random);
      const Vec3 turn = place + lift * side.normal;
      if (trace.clear_rays().occluded(start, turn)) continue;
      seen += trace.transmittance(start, turn) *
              specular_share(material, reflectance_at(trace.scene(), surface, place)) *
              reflected_into(lit, turn, mirrored(glm::normalize(place - point), side.normal));
    }
    sum += factor / rays_per_mirror * seen;
  }
  return sum;
}

/// Calls at(element, point, normal) for all elements that light reaches, in tasks of a group.
template <class At>
void for_each_element(const Mesh& mesh, const Parallel& parallel, At at) {
  parallel.for_each(mesh.groups.size(), [&](std::size_t g) {
    if (!mesh.group_is_lit[g]) return;
    const Group& group = mesh.groups[g];
    const Plane& plane = mesh.planes[group.plane.value];
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p)
      for (std::uint32_t k = 0; k < mesh.patches[p].element_count; ++k) {
        const std::uint32_t e = mesh.patches[p].first_element + k;
        at(e, plane.point(mesh.elements[e].centre), plane.normal);
      }
  });
}

std::vector<Rgb> shown_by_mirrors(const LitScene& lit, const std::vector<MirrorSide>& sides, const Mesh& mesh,
                                  const Parallel& parallel) {
  std::vector<Rgb> shown(mesh.elements.size(), Rgb{0.0});
  for_each_element(mesh, parallel, [&](std::uint32_t e, const Vec3& point, const Vec3& normal) {
    Random random(e, 29);
    shown[e] = shown_by_mirrors(lit, sides, point, normal, random);
  });
  return shown;
}

/// Nothing shot yet, and what mirrors show of luminaires received.
Solution luminaires_by_mirrors(const MirrorImages& images, std::shared_ptr<const Scene> scene,
                               std::shared_ptr<const Mesh> mesh, const Parallel& parallel) {
  Solution solution = blank_solution(std::move(scene), std::move(mesh));
  for_each_element(*solution.mesh, parallel, [&](std::uint32_t e, const Vec3& point, const Vec3& normal) {
    std::uint64_t rays = 0;
    solution.irradiance[e] = solution.direct_irradiance[e] =
        Rgbf{images.irradiance(point, normal, rays_per_image, e, rays)};
  });
  return solution;
}

/// The scene's light as few elements hold it.
Solution coarse_light(const MirrorImages& images, const Solution& fine, const Parallel& parallel) {
  MeshOptions options;
  options.target_elements = coarse_elements;
  Solution solution = luminaires_by_mirrors(
      images, fine.scene, std::make_shared<const Mesh>(mesh_of(*fine.scene, options, fine.mesh->lit_sides)), parallel);
  shoot_in_one_cell(solution, coarse_eps, parallel);
  return solution;
}

double power(const Mesh& mesh, const std::vector<Rgbf>& irradiance) {
  double sum = 0;
  for (std::size_t e = 0; e < irradiance.size(); ++e)
    sum += static_cast<double>(mesh.elements[e].area) * sum_channels(Rgb{irradiance[e]});
  return sum;
}

}  // namespace

std::optional<Solution> light_by_mirrors(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh,
                                         const SolveOptions& options, const Parallel& parallel) {
  if (options.method == TransferMethod::hemicube) return std::nullopt;
  const std::vector<MirrorSide> sides = mirror_sides(*scene);
  if (sides.empty()) return std::nullopt;
  const MirrorImages images(std::make_shared<const TraceScene>(scene));
  Solution solution = luminaires_by_mirrors(images, std::move(scene), std::move(mesh), parallel);
  solution.options = options;
  solution.energy.mirrored_direct = power(*solution.mesh, solution.irradiance);
  if (sides.size() <= 2 * most_mirrors) {
    const LitScene lit(coarse_light(images, solution, parallel));
    const std::vector<Rgb> shown = shown_by_mirrors(lit, sides, *solution.mesh, parallel);
    for (std::size_t e = 0; e < shown.size(); ++e) solution.irradiance[e] += Rgbf{shown[e]};
  }
  solution.energy.mirrored = power(*solution.mesh, solution.irradiance);
  return solution;
}

}  // namespace lichthof
