/// What happened inside a machine, as data: logs, metrics and tests read these; machines write nothing anywhere.
#pragma once

#include <cstdint>
#include <variant>

#include "core/base/ids.hpp"

namespace lichthof {

struct ShotFired { ShotId shot; double power_w = 0; bool external = false; CellId cell; double received_w = 0; };
struct BitmapsJoined { ShotId shot; CellId cell; std::uint32_t parts = 0; };
struct VisitSkipped { ShotId shot; CellId cell; };                    ///< behind the shooter or wholly covered
struct ChangeApplied { SceneVersion version; CellId cell; };
struct CellIdle { CellId cell; };
struct Converged { std::uint64_t shots = 0; };
struct JobAssigned { WorkerId worker; std::uint32_t first = 0, last = 0; };
struct JobFinished { WorkerId worker; std::uint32_t first = 0, last = 0; };
/// What can't be about a shot.
struct ShotFault {
  const char* what = nullptr;  ///< static text; nullptr: nothing is wrong
  ShotId shot;
  GroupId group;
  std::uint32_t patch = whole;  ///< number in the shot; `whole`: not one patch's fault
  static constexpr std::uint32_t whole = ~0u;
};
struct MessageRefused { CellId cell; ShotFault fault{}; };            ///< a peer sent what can't be

using Event = std::variant<ShotFired, BitmapsJoined, VisitSkipped, ChangeApplied, CellIdle, Converged, JobAssigned, JobFinished,
                           MessageRefused>;

}  // namespace lichthof
