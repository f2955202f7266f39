/// The first pass of a whole scene in one cell, shot by shot: no protocol, just the light.
#pragma once

#include <cmath>
#include <memory>
#include <numeric>

#include "core/light/lit_sides.hpp"
#include "core/light/expected_light.hpp"
#include "core/light/one_cell.hpp"

namespace lichthof::test {

inline std::vector<LitSides> lit_sides_of(const Scene& scene, double patch_size) {
  const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
  return lit_sides(scene, rays, 2 * patch_size, Parallel(1));
}

inline std::shared_ptr<const Mesh> mesh_with(const Scene& scene, double patch_size, bool find_dark_sides = true) {
  MeshOptions options;
  options.patch_size = patch_size;
  const std::vector<LitSides> lit = find_dark_sides ? lit_sides_of(scene, patch_size) : std::vector<LitSides>{};
  return std::make_shared<const Mesh>(mesh_of(scene, options, lit));
}

class OneCell {
 public:
  OneCell(std::shared_ptr<const Scene> scene_, std::shared_ptr<const Mesh> mesh_, const TransferOptions& options = {},
          unsigned threads = 1)
      : scene(std::move(scene_)),
        mesh(std::move(mesh_)),
        exchange(std::make_shared<const GroupExchange>(*scene, *mesh, Parallel(threads))),
        light(light_of_all(scene, mesh, options, std::make_shared<const Parallel>(threads), exchange)) {}

  /// Shoots one group. @pre strongest() was called since the last shot, as a cell does
  TransferWork shoot(GroupId group) {
    const Shot shot = light.take_shot(group, {CellId{0}, shots++}, {});
    const TransferWork work = light.receive(shot, nullptr);
    sent_w += shot.power();
    received_w += work.received;
    return work;
  }

  /// Shoots until the strongest group is below `end_w`.
  void solve_to(double end_w) {
    for (auto next = light.strongest(); next.power_w > end_w; next = light.strongest()) shoot(next.group);
  }
  void solve(double eps) { solve_to(eps * light.largest_initial_power()); }

  Solution solution() const { return solution_by(mesh); }
  /// @param changed  the mesh with emission and reflectance as they have become
  Solution solution_by(std::shared_ptr<const Mesh> changed) const {
    Solution solution = blank_solution(scene, std::move(changed));
    light.store(solution);
    set_pending(solution, *exchange);
    return solution;
  }

  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const GroupExchange> exchange;
  CellLight light;
  std::uint64_t shots = 0;
  Rgb sent_w{0.0}, received_w{0.0};  ///< of all shots so far
};

/// Root of the area mean of the squared difference of irradiance, the light still to come included, relative to b.
inline double relative_rms(const Solution& a, const Solution& b) {
  double difference = 0, whole = 0;
  for (std::size_t e = 0; e < b.irradiance.size(); ++e) {
    const double area = b.mesh->elements[e].area;
    const Rgb reference = Rgb{b.irradiance[e]} + Rgb{b.pending[e]};
    const Rgb d = Rgb{a.irradiance[e]} + Rgb{a.pending[e]} - reference;
    difference += area * glm::dot(d, d);
    whole += area * glm::dot(reference, reference);
  }
  return std::sqrt(difference / whole);
}

}  // namespace lichthof::test
