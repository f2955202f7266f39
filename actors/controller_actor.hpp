/// The controller of a first pass in real time: the machine of core/cluster with a mailbox.
#pragma once

#include <memory>
#include <vector>

#include "actors/cell_actor.hpp"
#include "actors/drive.hpp"
#include "core/cluster/controller.hpp"

namespace lichthof::actors {

struct ControllerState : Driven<Controller> {
  static constexpr const char* name = "controller";
  RunContext context;
  std::vector<CellControl> cells;  ///< by CellId
};
using ControllerSelf = caf::stateful_actor<ControllerState, Metered<ControllerActor::base>>;

/// On `begin` it introduces the cells to each other, which sets them going. It quits when the run is finished, or with the
/// reason why a cell was lost before.
/// @param controller  nobody else touches it while the actor lives
ControllerActor::behavior_type controller_actor(ControllerSelf* self, std::shared_ptr<Controller> controller,
                                                std::vector<CellControl> cells, RunContext context);

}  // namespace lichthof::actors
