/// From wishes about sizes to a mesh that fits into memory, with what can be wrong about them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/parallel.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::apps {

struct ChosenMesh {
  std::shared_ptr<const Mesh> mesh;
  std::vector<std::string> warnings;  ///< luminaires turned the wrong way, sizes that could not be had; one line each
};

/// Finds the sides that light reaches and cuts them. Of a number of elements that memory can't hold as many as it can are made; a size
/// that can't be held is refused.
/// @param free_bytes  memory that may be taken
/// @error bad_input: a size that must be a typing error, or that there is no memory for; nothing that could be lit
Expected<ChosenMesh> mesh_for(const Scene& scene, const MeshOptions& wanted, const Parallel& parallel,
                              std::uint64_t free_bytes);

}  // namespace lichthof::apps
