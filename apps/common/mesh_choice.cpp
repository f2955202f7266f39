#include "apps/common/mesh_choice.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/common/options.hpp"
#include "core/light/lit_sides.hpp"
#include "core/light/raycast.hpp"

namespace lichthof::apps {

namespace {

// Blocks are numbered with 16 bits along each axis.
constexpr double most_blocks = 60000;

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

/// Refuses sizes that are typing errors before memory is taken for them.
Status plausible_sizes(const Scene& scene, const MeshOptions& options) {
  if (options.patch_size <= 0 && options.element_size <= 0) return Done{};
  const double patch = options.patch_size > 0 ? options.patch_size : 4 * options.element_size;
  // A patch holds at most 16 elements, however small they are asked to be.
  const double element = std::max(options.element_size > 0 ? options.element_size : patch / 4, patch / 4);
  const double elements = 2 * total_area(scene) / (element * element);
  const char* option = options.patch_size > 0 ? "--patch" : "--element";
  if (elements > most_elements) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "would cut the scene into some %.2g elements, at most %.2g are possible; choose a larger size",
                  elements, static_cast<double>(most_elements));
    return Error{ErrorCode::bad_input, option, text};
  }
  if (max_channel(bounds(scene).size()) / (2 * patch) > most_blocks)
    return Error{ErrorCode::bad_input, option,
                 "is below a hundred-thousandth of the scene's size; choose a larger size"};
  return Done{};
}

}  // namespace

Expected<std::shared_ptr<const Mesh>> mesh_for(const Scene& scene, const MeshOptions& wanted,
                                               const Parallel& parallel) {
  if (Status plausible = plausible_sizes(scene, wanted); !plausible) return plausible.error();
  if (wanted.element_size > 0 && wanted.element_size < wanted.patch_size / 4)
    spdlog::warn("a patch holds at most 16 elements: those of patches of {} m are larger than the {} m asked for",
                 wanted.patch_size, wanted.element_size);
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  const std::vector<LitSides> lit = lit_sides(scene, rays, expected_block(scene, wanted), parallel);
  auto mesh = std::make_shared<Mesh>(mesh_of(scene, wanted, lit));
  if (mesh->elements.empty())
    return Error{ErrorCode::bad_input, "", "has no face that could be lit: glass and hidden faces hold no light"};
  return std::shared_ptr<const Mesh>(std::move(mesh));
}

}  // namespace lichthof::apps
