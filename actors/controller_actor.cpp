#include "actors/controller_actor.hpp"

namespace lichthof::actors {

namespace {

struct ControllerRoute {
  ControllerSelf* self;
  template <class M>
  requires is_one_of<M, std::variant<StartRadiosity, PollCell, StopRadiosity, GeometryChange>>
  void operator()(CellId to, M&& message) const { self->send(self->state.cells[to.value], message); }
};

/// All in one go, so that no cell works before the last one knows the others.
void begin(ControllerSelf* self) {
  auto& state = self->state;
  Introduction introduction;
  introduction.controller = caf::actor_cast<ReportSink>(self);
  introduction.cells = std::make_shared<const std::vector<HemicubeSink>>(state.cells.begin(), state.cells.end());
  for (const CellControl& cell : state.cells) {
    self->monitor(cell);
    self->send(cell, introduction);
  }
}

void lose_cell(ControllerSelf* self, const caf::down_msg& down) {
  if (!self->state.machine->finished()) self->quit(down.reason);
}

}  // namespace

ControllerActor::behavior_type controller_actor(ControllerSelf* self, std::shared_ptr<Controller> controller,
                                                std::vector<CellControl> cells, RunContext context) {
  report_failures(self, "controller");
  self->show_meter(context.meters, "controller");
  self->set_down_handler([self](caf::down_msg& down) { lose_cell(self, down); });
  self->state.machine = std::move(controller);
  self->state.clock = context.clock;
  self->state.cells = std::move(cells);
  self->state.context = std::move(context);

  return {
      [=](const CellReady& message) { accept(self, message.cell, ToController{}, message); },
      [=](const CellReport& message) { accept(self, message.cell, ToController{}, message); },
      [=](begin_atom) { begin(self); },
      [=](Stop how) {
        self->state.machine->stop(how);
        wake(self);
      },
      [=](const GeometryChange& message) { accept(self, ToController{}, ToController{}, message); },
      [=](iterate_atom) {
        auto& state = self->state;
        iterate(self, ControllerRoute{self});
        if (state.context.board) state.context.board->post(state.machine->progress());
        if (state.machine->finished()) self->quit();
      },
      [=](wake_atom) { wake(self); },
  };
}

}  // namespace lichthof::actors
