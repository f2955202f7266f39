#include "core/light/one_cell.hpp"

#include <limits>

#include "core/light/expected_light.hpp"

namespace lichthof {

CellLight light_of_all(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh,
                       const TransferOptions& options, std::shared_ptr<const Parallel> parallel,
                       std::shared_ptr<const GroupExchange> exchange) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<GroupId> groups(mesh->groups.size());
  for (std::uint32_t g = 0; g < groups.size(); ++g) groups[g] = GroupId{g};
  return {std::move(scene), std::move(mesh),    std::move(groups), Box{Vec3{-infinite}, Vec3{infinite}},
          options,          std::move(parallel), std::move(exchange)};
}

void shoot_in_one_cell(Solution& solution, double eps, const Parallel& parallel) {
  const auto exchange = std::make_shared<const GroupExchange>(*solution.scene, *solution.mesh, parallel);
  CellLight light = light_of_all(solution.scene, solution.mesh, {},
                                 std::shared_ptr<const Parallel>(std::shared_ptr<void>(), &parallel),  // not its own
                                 exchange);
  light.load(solution);
  const double least = eps * light.largest_initial_power();
  std::uint64_t shots = 0;
  for (auto next = light.strongest(); next.power_w > least; next = light.strongest())
    light.receive(light.take_shot(next.group, {CellId{0}, shots++}, {}), nullptr);
  light.store(solution);
  set_pending(solution, *exchange);
}

Solution blank_solution(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh) {
  Solution solution;
  solution.scene = std::move(scene), solution.mesh = std::move(mesh);
  for (auto* values : {&solution.irradiance, &solution.direct_irradiance, &solution.shot, &solution.pending})
    values->assign(solution.mesh->elements.size(), Rgbf{0.f});
  return solution;
}

}  // namespace lichthof
