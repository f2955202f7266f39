#include "apps/common/mesh_choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

#include "apps/common/options.hpp"
#include "core/light/coarseness.hpp"
#include "core/light/lit_sides.hpp"
#include "core/light/lost_light.hpp"
#include "core/light/raycast.hpp"

namespace lichthof::apps {

namespace {

// What an element and its share of patches and light take (bytes): 280 to 360 were measured in first passes of the Cornell box and the
// office, 440 000 to 1 500 000 elements; what shots note of shadows and the second pass come on top.
constexpr double bytes_of_element = 500;
// Of the free memory that one mesh may be meant to take.
constexpr double share_of_free = 0.9;

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

double total_area(const Scene& scene) {
  double area = 0;
  for (const Surface& surface : scene.surfaces) area += surface.area;
  return area;
}

/// Size of a block (m) before the mesh is there: both sides of all surfaces could be lit, one side usually is.
double expected_block(const Scene& scene, const MeshOptions& options) {
  if (options.patch_size > 0) return 2 * options.patch_size;
  if (options.element_size > 0) return 8 * options.element_size;
  return 8 * std::sqrt(total_area(scene) / options.target_elements);
}

/// What is wrong with sizes that were given: typing errors, and what memory can not hold.
Status sizes_fit(const MeshForecast& forecast, const MeshOptions& options, double most) {
  const char* option = options.patch_size > 0 ? "--patch" : "--element";
  if (forecast.elements > most_elements)
    return Error{
        ErrorCode::bad_input, option,
        formatted("would cut the scene into some %.2g elements, at most %.2g are possible; choose a larger size",
                  forecast.elements, static_cast<double>(most_elements))};
  if (forecast.elements > most)
    return Error{
        ErrorCode::bad_input, option,
        formatted("would cut the scene into some %.2g elements, which take about %.2g GB; %.2g GB of memory are free; "
                  "choose a larger size",
                  forecast.elements, forecast.elements * bytes_of_element / 1e9,
                  most * bytes_of_element / share_of_free / 1e9)};
  if (forecast.blocks > most_blocks)
    return Error{ErrorCode::bad_input, option,
                 "is below a hundred-thousandth of what is lit of the scene; choose a larger size"};
  return Done{};
}

/// One line for each material whose luminaires are turned the wrong way, and each way that is.
std::vector<std::string> warnings_of(const Scene& scene, const std::vector<LostLight>& lost) {
  using Kind = std::pair<std::uint32_t, LostLight::Where>;
  std::map<Kind, std::vector<std::uint32_t>> by_kind;
  for (const LostLight& light : lost)
    by_kind[{scene.surfaces[light.surface].material, light.where}].push_back(light.surface);
  std::vector<std::string> lines;
  for (const auto& [kind, surfaces] : by_kind) {
    Rgb power{0.0};
    for (const std::uint32_t s : surfaces)
      power += std::numbers::pi * scene.surfaces[s].area * scene.material_of(scene.surfaces[s]).radiance;
    const Surface& first = scene.surfaces[surfaces.front()];
    const Vec3 at = scene.file_frame.point_to_file(centroid(std::span<const Vec3>(first.corners)));
    lines.push_back(formatted(
        "luminaire of material '%.60s' (face %u, at %.4g, %.4g, %.4g%s; %.3g W): %s",
        scene.materials[kind.first].name.c_str(), first.source_face, at.x, at.y, at.z,
        surfaces.size() > 1 ? formatted(", and %zu more", surfaces.size() - 1).c_str() : "", sum_channels(power),
        kind.second == LostLight::Where::into_support ? "it shines into the surface it lies on (turned the wrong way?)"
                                                      : "all its light leaves the scene (turned the wrong way?)"));
  }
  return lines;
}

}  // namespace

Expected<ChosenMesh> mesh_for(const Scene& scene, const MeshOptions& wanted, const Parallel& parallel,
                              std::uint64_t free_bytes) {
  ChosenMesh chosen;
  if (wanted.element_size > 0 && wanted.element_size < wanted.patch_size / 4)
    chosen.warnings.push_back(
        formatted("a patch holds at most 16 elements: those of patches of %g m are larger than the %g m asked for",
                  wanted.patch_size, wanted.element_size));
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  const std::vector<std::string> lost = warnings_of(scene, lost_light(scene, rays, parallel));
  chosen.warnings.insert(chosen.warnings.end(), lost.begin(), lost.end());
  std::vector<LitSides> lit = lit_sides(scene, rays, expected_block(scene, wanted), parallel);

  MeshOptions sizes = wanted;
  const double most = std::max(1000.0, share_of_free * static_cast<double>(free_bytes) / bytes_of_element);
  if (wanted.patch_size > 0 || wanted.element_size > 0) {
    if (Status fit = sizes_fit(forecast_of(scene, wanted, lit), wanted, most); !fit) return fit.error();
  } else {
    find_coarseness(scene, rays, parallel, lit);
    if (wanted.target_elements > most) {
      sizes.target_elements = static_cast<std::uint32_t>(most);
      chosen.warnings.push_back(
          formatted("%u elements take about %.2g GB, %.2g GB of memory are free: the mesh gets %u",
                    wanted.target_elements, wanted.target_elements * bytes_of_element / 1e9,
                    static_cast<double>(free_bytes) / 1e9, sizes.target_elements));
    }
  }
  auto mesh = std::make_shared<Mesh>(mesh_of(scene, sizes, lit));
  if (mesh->elements.empty())
    return Error{ErrorCode::bad_input, "", "has no face that could be lit: glass and hidden faces hold no light"};
  // Rays begin and end so far off surfaces; a tenth of an element is where pictures begin to show it.
  if (const double apart = rays.offset(), most_apart = 0.1 * mesh->options.element_size; apart > most_apart) {
    const double extent = max_channel(bounds(scene).size());
    chosen.warnings.push_back(
        formatted("the scene is %.3g m across, so rays tell places %.2g m apart only, and elements are %.2g m large: "
                  "light near edges is "
                  "wrong; up to %.2g m across it would be right",
                  extent, apart, mesh->options.element_size, extent * most_apart / apart));
  }
  chosen.mesh = std::move(mesh);
  return chosen;
}

}  // namespace lichthof::apps
