/// A cell in real time: the machine of core/cell with a mailbox.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "actors/board.hpp"
#include "actors/drive.hpp"
#include "core/cell/cell.hpp"

namespace lichthof::actors {

/// What the actors of a first pass share.
struct RunContext {
  Clock clock;
  std::shared_ptr<Board> board;
  std::shared_ptr<Meters> meters;  ///< may be empty
  std::shared_ptr<const std::atomic<bool>> hold;  ///< see Cell::hold; may be empty
  std::function<void(const Cell&)> after_step;    ///< and after light has arrived; on the cell's own thread
};

struct CellState : Driven<Cell> {
  static constexpr const char* name = "cell";
  RunContext context;
  ReportSink controller;
  std::vector<std::pair<CellId, HemicubeSink>> neighbours;  ///< at most two along each axis
  std::uint64_t seen = 0;                                   ///< see Board::is_asked
};
using CellSelf = caf::stateful_actor<CellState, Metered<CellActor::base>>;

/// It rests until it is introduced to the others. @param cell  nobody else touches it while the actor lives
CellActor::behavior_type cell_actor(CellSelf* self, std::shared_ptr<Cell> cell, RunContext context);

}  // namespace lichthof::actors
