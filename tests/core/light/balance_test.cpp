#include "core/light/balance.hpp"

#include <doctest/doctest.h>

#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// The exact light of a furnace, in which every surface sends 1 W/m² and reflects half of what arrives.
Solution furnace_light(const std::shared_ptr<Scene>& scene) {
  Solution solution;
  solution.scene = scene;
  solution.mesh = mesh_with(*scene, 0.5);
  const std::size_t elements = solution.mesh->elements.size();
  solution.direct_irradiance.assign(elements, Rgbf{1.f});
  solution.irradiance.assign(elements, Rgbf{2.f});
  solution.shot.assign(elements, Rgbf{2.f});
  solution.pending.assign(elements, Rgbf{0.f});
  solution.converged = true;
  return solution;
}

std::shared_ptr<Scene> furnace() {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {0, 0, 0}, {2, 3, 1.5}, add_material(*scene, luminous(1 / std::numbers::pi, 0.5)), true);
  return scene;
}

/// What the scaled light leaves of the ledger, relative to what is emitted.
double rest(const Solution& solution) {
  double emitted = 0, absorbed = 0;
  for (const Patch& patch : solution.mesh->patches) {
    emitted += sum_channels(patch.exitance) * patch.area;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
      absorbed += solution.mesh->elements[e].area * sum_channels((1.0 - patch.reflectance) * solution.total(e));
  }
  return 1 - absorbed / emitted;
}

}  // namespace

TEST_SUITE("balance") {
  const Parallel one(1);

  TEST_CASE("balance: light that agrees with its sources stays as it is") {
    Solution solution = furnace_light(furnace());
    balance(solution, one);
    CHECK(solution.energy.escaped == 0);
    CHECK(solution.energy.gain_direct == doctest::Approx(1).epsilon(1e-6));
    CHECK(solution.energy.gain_indirect == doctest::Approx(1).epsilon(1e-6));
  }

  TEST_CASE("balance: what arrived too weak or too strong is scaled to what was sent, straight light and other apart") {
    Solution solution = furnace_light(furnace());
    solution.direct_irradiance.assign(solution.irradiance.size(), Rgbf{1.02f});
    solution.irradiance.assign(solution.irradiance.size(), Rgbf{1.02f + 0.9f});
    solution.pending.assign(solution.irradiance.size(), Rgbf{0.07f});  // still to come counts as what has come
    balance(solution, one);
    CHECK(solution.energy.gain_direct == doctest::Approx(1 / 1.02).epsilon(1e-6));
    CHECK(solution.energy.gain_indirect == doctest::Approx(1 / 0.97).epsilon(1e-6));
    CHECK(solution.total(0).x == doctest::Approx(2).epsilon(1e-6));
    CHECK(std::abs(rest(solution)) < 1e-6);

    Solution stopped = furnace_light(furnace());
    stopped.direct_irradiance.assign(stopped.irradiance.size(), Rgbf{0.5f});
    stopped.converged = false;  // half of it is still to be sent
    balance(stopped, one);
    CHECK(stopped.energy.gain_direct == 1);
    CHECK(stopped.energy.gain_indirect == 1);
  }

  TEST_CASE("balance: of a difference only what the noise of escaping light lets be told counts") {
    auto scene = furnace();
    scene->surfaces.pop_back();  // one side is open
    Solution solution = furnace_light(scene);
    balance(solution, one);
    REQUIRE(solution.energy.escaped > 0);
    // Too much arrives by far: 1 W/m² everywhere although not every hemisphere is full of sources.
    CHECK(solution.energy.gain_direct < 0.95);
    const double sent = solution.energy.gain_direct;
    for (Rgbf& direct : solution.direct_irradiance) direct *= static_cast<float>(sent);
    balance(solution, one);
    CHECK(std::abs(solution.energy.gain_direct - 1) < 2e-3);
  }

  TEST_CASE("balance: the ledger of a furnished room closes") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t wall = add_material(*scene, diffuse(0.7)), lamp = add_material(*scene, luminous(10, 0.3));
    add_box(*scene, {0, 0, 0}, {4, 4, 3}, wall, true);
    add_box(*scene, {1, 1, 0}, {1.7, 1.4, 1.2}, wall, false);
    add_rectangle(*scene, {2, 2, 2.9}, {0, 0.5, 0}, {0.5, 0, 0}, lamp);
    OneCell cell(scene, mesh_with(*scene, 0.8));
    cell.solve(5e-4);
    Solution solution = cell.solution();
    solution.converged = true;
    const double before = rest(solution);
    balance(solution, one);
    MESSAGE("rest " << before << " -> " << rest(solution) << ", gains " << solution.energy.gain_direct << " and "
                    << solution.energy.gain_indirect);
    CHECK(std::abs(before) > 1e-3);
    CHECK(std::abs(rest(solution)) < 1e-6);
  }
}
