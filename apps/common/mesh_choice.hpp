/// From wishes about sizes to a mesh, with what can be wrong about them.
#pragma once

#include <memory>

#include "core/base/expected.hpp"
#include "core/base/parallel.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof::apps {

/// Finds the sides that light reaches and cuts them. A size that a patch can't hold is warned of.
/// @error bad_input: a size that must be a typing error; nothing that could be lit
Expected<std::shared_ptr<const Mesh>> mesh_for(const Scene& scene, const MeshOptions& wanted, const Parallel& parallel);

}  // namespace lichthof::apps
