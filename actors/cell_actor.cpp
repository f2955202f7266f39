#include "actors/cell_actor.hpp"

namespace lichthof::actors {

namespace {

/// Cells one step away along one axis: all a cell ever sends to (routing).
std::vector<CellId> next_to(const CellGrid& grid, CellId cell) {
  std::vector<CellId> found;
  const CellPosition here = grid.position(cell);
  for (int axis = 0; axis < 3; ++axis) {
    CellPosition there = here;
    if (here[axis] > 0) --there[axis], found.push_back(grid.at(there));
    there = here;
    if (here[axis] + 1 < grid.size()[axis]) ++there[axis], found.push_back(grid.at(there));
  }
  return found;
}

void introduce(CellSelf* self, const Introduction& introduction) {
  auto& state = self->state;
  state.controller = introduction.controller;
  state.neighbours.clear();
  for (const CellId cell : next_to(state.machine->grid(), state.machine->id()))
    if (introduction.cells && cell.value < introduction.cells->size())
      state.neighbours.emplace_back(cell, (*introduction.cells)[cell.value]);
}

/// To whom a cell can say what.
struct CellRoute {
  CellSelf* self;
  void operator()(CellId to, HemicubeMessage&& message) const {
    for (const auto& [cell, sink] : self->state.neighbours)
      if (cell == to) return self->send(sink, std::move(message));
    log_undeliverable(to);
  }
  void operator()(ToController, CellReady&& message) const { self->send(self->state.controller, message); }
  void operator()(ToController, CellReport&& message) const { self->send(self->state.controller, message); }
};

/// When asked, and when nothing is left to do: an idle cell takes no step by which it could answer later.
void post_figures(CellSelf* self) {
  auto& state = self->state;
  const Cell& cell = *state.machine;
  if (!state.context.board) return;
  const bool is_resting = cell.idle() && self->mailbox().empty();
  if (!state.context.board->is_asked(state.seen) && !is_resting) return;
  const CellPower power = cell.light().power();
  const Cell::State counts = cell.state();
  CellReport report;
  report.cell = cell.id();
  report.idle = cell.idle();
  report.messages_sent = counts.sent;
  report.messages_processed = counts.processed;
  report.shots = counts.local_shots;
  report.strongest_w = cell.light().strongest().power_w;
  report.unshot_w = power.unshot;
  report.emitted_w = power.emitted;
  state.context.board->post(report);
}

}  // namespace

CellActor::behavior_type cell_actor(CellSelf* self, std::shared_ptr<Cell> cell, RunContext context) {
  const CellId id = cell->id();
  report_failures(self, text(Address{id}));
  self->show_meter(context.meters, text(Address{id}));
  self->state.machine = std::move(cell);
  self->state.clock = context.clock;
  self->state.context = std::move(context);

  const auto order = [=](const auto& message) { accept(self, ToController{}, id, message); };
  return {
      [=](HemicubeMessage& message) {
        const Address from = message.from;
        accept(self, from, id, std::move(message));
        if (self->state.context.after_step) self->state.context.after_step(*self->state.machine);
      },
      [=](const Introduction& introduction) {
        introduce(self, introduction);
        wake(self);
      },
      [=](const StartRadiosity& message) { order(message); },
      [=](const PollCell& message) { order(message); },
      [=](const StopRadiosity& message) { order(message); },
      [=](const GeometryChange& message) { order(message); },
      [=](iterate_atom) {
        const RunContext& run = self->state.context;
        if (run.hold) self->state.machine->hold(*run.hold);
        iterate(self, CellRoute{self});
        post_figures(self);
        if (run.after_step) run.after_step(*self->state.machine);
      },
      [=](wake_atom) {
        if (self->state.context.hold) self->state.machine->hold(*self->state.context.hold);
        wake(self);
      },
      [=](const Look& look) { look.at(*self->state.machine); },
  };
}

}  // namespace lichthof::actors
