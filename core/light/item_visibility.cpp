#include "core/light/item_visibility.hpp"

namespace lichthof {

PatchOutlines::PatchOutlines(const Mesh& mesh, std::span<const GroupId> groups) {
  for (const GroupId id : groups) {
    const Group& group = mesh.groups[id.value];
    const Plane& plane = mesh.planes[group.plane.value];
    for (std::uint32_t p = group.first_patch; p < group.first_patch + group.patch_count; ++p) {
      Outline outline;
      for (const Vec2& corner : mesh.polygon(mesh.patches[p].polygon)) outline.corners.push_back(plane.point(corner));
      outline.normal = plane.normal;
      outline.plane = group.plane.value;
      outline.both_sides = mesh.lit_sides.empty() || mesh.lit_sides[group.surface.value].back;
      outlines_.push_back(std::move(outline));
    }
  }
}

ItemVisibility::ItemVisibility(const Shot& shot, const PatchOutlines& outlines, const HemicubeBitmap* incoming,
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
    for (const PatchOutlines::Outline& outline : outlines.outlines()) {
      const bool faces = glm::dot(outline.normal, frames_[p].centre - outline.corners[0]) > 0;
      // The same polygon stands twice where both sides are lit: the side that faces the shooter is the item.
      if (!faces && outline.both_sides) continue;
      buffers_[p].project(frames_[p], outline.corners, static_cast<std::uint32_t>(plane_of_item_[p].size()));
      plane_of_item_[p].push_back(faces ? outline.plane : dark_side);
    }
  });
}

}  // namespace lichthof
