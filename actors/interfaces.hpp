/// Every typed actor interface on one page, smallest first. Whoever holds a handle can call what its interface says and
/// nothing else: a cell reaches its neighbours as HemicubeSink, so it can not stop them.
///
/// There is no sender in these messages but the one they name themselves; interface and message together say in which
/// role it was sent, and that is what the machine at the other end is told.
#pragma once

#include <caf/all.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "core/cell/cell.hpp"
#include "core/cluster/controller.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof::actors {

/// To oneself: there is work, do one step of it.
using iterate_atom = caf::atom_constant<caf::atom("iterate")>;
constexpr iterate_atom iterate_atom_v{};
/// To oneself, later: see whether there is work (Effects::wake_at).
using wake_atom = caf::atom_constant<caf::atom("wake")>;
constexpr wake_atom wake_atom_v{};
/// To the controller: everybody is there, begin.
using begin_atom = caf::atom_constant<caf::atom("begin")>;
constexpr begin_atom begin_atom_v{};

// ---- First pass -------------------------------------------------------------------------------------------------------

/// What a cell may do to another cell: send light.
using HemicubeSink = caf::typed_actor<caf::reacts_to<HemicubeMessage>>;

/// What a cell may do to the controller.
using ReportSink = caf::typed_actor<caf::reacts_to<CellReady>, caf::reacts_to<CellReport>>;

/// Who is who, from the controller to each cell before anything else; a cell keeps the few that are next to it.
struct Introduction {
  ReportSink controller;
  std::shared_ptr<const std::vector<HemicubeSink>> cells;  ///< by CellId; one list for all cells of a process
};

/// Somebody in this process wants to see a cell as it is: called on the cell's own thread, between two steps.
struct Look {
  std::function<void(const Cell&)> at;
};

/// What the controller may do to a cell.
using CellControl =
    HemicubeSink::extend<caf::reacts_to<Introduction>, caf::reacts_to<Look>, caf::reacts_to<StartRadiosity>, caf::reacts_to<PollCell>,
                         caf::reacts_to<StopRadiosity>, caf::reacts_to<GeometryChange>>;
/// A cell as it sees itself.
using CellActor = CellControl::extend<caf::reacts_to<iterate_atom>, caf::reacts_to<wake_atom>>;

/// What a client may do to a run.
using RunControl = caf::typed_actor<caf::reacts_to<begin_atom>, caf::reacts_to<Stop>, caf::reacts_to<GeometryChange>>;

/// The controller as it sees itself.
using ControllerActor =
    ReportSink::extend<caf::reacts_to<begin_atom>, caf::reacts_to<Stop>, caf::reacts_to<GeometryChange>,
                       caf::reacts_to<iterate_atom>, caf::reacts_to<wake_atom>>;

// ---- Second pass ------------------------------------------------------------------------------------------------------

/// What the balancer may do to a worker.
using JobSink = caf::typed_actor<caf::reacts_to<JobAssignment>>;

/// A worker's first message: here I am. From then on the balancer notices when it is lost.
struct Enlistment {
  WorkerId worker;
  JobSink sink;
};

/// What a worker may do to the balancer.
using JobSource =
    caf::typed_actor<caf::reacts_to<Enlistment>, caf::reacts_to<JobRequest>, caf::reacts_to<ColumnResult>>;

using WorkerActor = JobSink::extend<caf::reacts_to<iterate_atom>, caf::reacts_to<wake_atom>>;
using BalancerActor = JobSource::extend<caf::reacts_to<iterate_atom>, caf::reacts_to<wake_atom>>;

}  // namespace lichthof::actors

// These never leave the process.
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Look)
