// Scene changes: numbered by the controller, queued by every cell, applied one per iteration.
#include <doctest/doctest.h>

#include <algorithm>

#include "core/cell/cell.hpp"
#include "core/cluster/controller.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

GeometryChange lamp(std::uint64_t version, double radiance) {
  return {SceneVersion{version}, SetEmission{9, Rgb{radiance}}};
}

std::vector<SceneVersion> applied(const Effects& effects) {
  std::vector<SceneVersion> versions;
  for (const Event& event : effects.events)
    if (const auto* change = std::get_if<ChangeApplied>(&event)) versions.push_back(change->version);
  return versions;
}

}  // namespace

TEST_SUITE("paper §2.1") {
  TEST_CASE("§2.1: the controller sends every change to every cell") {
    Controller controller({3, 1e-3, {}});
    for (std::uint32_t c = 0; c < 3; ++c) controller.accept({CellId{c}, ToController{}, CellReady{CellId{c}, 1.0}}, {});
    controller.step({});
    controller.accept({ToController{}, ToController{}, lamp(0, 5)}, {});
    controller.accept({ToController{}, ToController{}, lamp(0, 6)}, {});

    const Effects effects = controller.step({});

    // First version 1, then version 2, to all three cells.
    std::vector<std::pair<Address, SceneVersion>> sent;
    for (const Envelope& envelope : effects.outbox)
      sent.emplace_back(envelope.to, std::get<GeometryChange>(envelope.message).version);
    REQUIRE(sent.size() == 6);
    for (std::uint32_t c = 0; c < 3; ++c) {
      CHECK(sent[c] == std::pair<Address, SceneVersion>{CellId{c}, SceneVersion{1}});
      CHECK(sent[3 + c] == std::pair<Address, SceneVersion>{CellId{c}, SceneVersion{2}});
    }
  }

  TEST_CASE("§2.1: a cell files changes in its queue and applies one per iteration") {
    const test::ToyWorld world = test::toy_world({1, 1, 1}, 3, 1);
    Cell cell(CellId{0}, world.grid, std::make_unique<test::ToyLight>(world, CellId{0}), {});
    cell.step({});
    cell.accept({ToController{}, CellId{0}, StartRadiosity{{}, 1e-3}}, {});
    for (const std::uint64_t version : {2, 3, 1})  // in whatever order they come
      cell.accept({ToController{}, CellId{0}, lamp(version, 10.0 * static_cast<double>(version))}, {});

    // One a step, in order of version, before anything is shot.
    for (const std::uint64_t version : {1, 2, 3}) CHECK(applied(cell.step({})) == std::vector<SceneVersion>{{version}});
    CHECK(cell.version() == SceneVersion{3});
    CHECK(cell.state().local_shots == 0);
    cell.step({});
    CHECK(cell.state().local_shots == 1);
  }
}
