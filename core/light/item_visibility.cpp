#include "core/light/item_visibility.hpp"

namespace lichthof {

ElementOutlines::ElementOutlines(const Mesh& mesh, std::span<const GroupId> groups) {
  for (const GroupId id : groups) {
    const Group& group = mesh.groups[id.value];
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) add(mesh, mesh.patches[p]);
  }
}

void ElementOutlines::add(const Mesh& mesh, const Patch& patch) {
  const Plane& plane = mesh.planes[patch.plane.value];
  for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
    const Polygon2 piece = mesh.element_polygon(patch, mesh.elements[e]);
    if (piece.empty()) continue;
    Outline outline;
    for (const Vec2& corner : piece) outline.corners.push_back(plane.point(corner));
    outline.normal = plane.normal;
    outline.plane = patch.plane.value;
    outline.both_sides = mesh.lit_sides.empty() || mesh.lit_sides[patch.surface.value].back;
    outlines_.push_back(std::move(outline));
  }
}

ItemVisibility::ItemVisibility(const Shot& shot, const ElementOutlines& outlines, const HemicubeBitmap* incoming,
                               std::uint32_t resolution, const Parallel& parallel)
    : buffers_(shot.patches.size(), ItemBuffer(resolution)), plane_of_item_(shot.patches.size()) {
  for (const ShotPatch& patch : shot.patches) {
    frames_.push_back(shot.frame());
    frames_.back().centre = shot.plane.point(centroid(patch.corners));
  }
  constexpr std::uint32_t dark_side = 0xffffffffu;
  parallel.for_each(shot.patches.size(), [&](std::size_t p) {
    if (incoming) buffers_[p].clear(*incoming);
    else buffers_[p].clear();
    for (const ElementOutlines::Outline& outline : outlines.outlines()) {
      const bool faces = glm::dot(outline.normal, frames_[p].centre - outline.corners[0]) > 0;
      // The same polygon stands twice where both sides are lit: the side that faces the shooter is the item.
      if (!faces && outline.both_sides) continue;
      buffers_[p].project(frames_[p], outline.corners, static_cast<std::uint32_t>(plane_of_item_[p].size()));
      plane_of_item_[p].push_back(faces ? outline.plane : dark_side);
    }
  });
}

}  // namespace lichthof
