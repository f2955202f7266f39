#include "core/light/stopping.hpp"

#include <algorithm>

namespace lichthof {

bool nothing_is_hidden(const Scene& scene, const Mesh& mesh) {
  constexpr std::size_t most_planes = 64;
  if (mesh.planes.size() > most_planes) return false;
  const double tolerance = 1e-6 * glm::length(bounds(scene).size());  // hides as little
  return std::ranges::all_of(mesh.planes, [&](const Plane& plane) {
    return std::ranges::all_of(scene.surfaces, [&](const Surface& surface) {
      return std::ranges::all_of(surface.corners, [&](const Vec3& corner) {
        return glm::dot(corner - plane.origin, plane.normal) >= -tolerance;
      });
    });
  });
}

double default_eps(const Scene& scene, const Mesh& mesh, TransferMethod method) {
  if (method == TransferMethod::hemicube) return 5e-4;
  return nothing_is_hidden(scene, mesh) ? 1e-5 : SolveOptions{}.eps;
}

}  // namespace lichthof
