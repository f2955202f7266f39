#include "core/cell/cell_invariants.hpp"

#include <cmath>

namespace lichthof {

namespace {

/// Float sums over some 10^4 elements.
constexpr double energy_tolerance = 1e-4;

std::string broken_count(const Cell& cell) {
  const Cell::State state = cell.state();
  if (state.received != state.processed + state.waiting_parts + state.queued_parts)
    return "received messages are neither processed nor waiting";
  if (state.most_joined > cell.grid().dimensions()) return "more bitmaps joined than the grid has divided axes";
  if (cell.grid().cell_count() == 1 && state.sent + state.received > 0)
    return "a cell that is alone has sent or received";
  return "";
}

std::string broken_join(const Cell& cell) {
  for (const auto& [id, waiting] : cell.join().waiting()) {
    if (waiting.from.size() >= waiting.expected.size()) return "a join waits although it is complete";
    for (const CellId from : waiting.from)
      if (!waiting.expected.contains(from)) return "a join holds a part of a cell that is no predecessor";
  }
  return "";
}

std::string broken_energy(const Cell& cell) {
  const CellPower power = cell.light().power();
  for (int channel = 0; channel < 3; ++channel) {
    const double in = power.emitted[channel] + power.received[channel];
    const double out = power.absorbed[channel] + power.shot[channel] + power.unshot[channel];
    const double scale =
        std::abs(power.emitted[channel]) + std::abs(power.received[channel]) + std::abs(power.shot[channel]);
    if (!(std::abs(in - out) <= energy_tolerance * scale))
      return "emitted + received differs from absorbed + shot + unshot";
  }
  return "";
}

}  // namespace

std::string broken_cell_invariant(const Cell& cell) {
  for (const auto check : {broken_count, broken_join, broken_energy})
    if (std::string broken = check(cell); !broken.empty())
      return "cell " + std::to_string(cell.id().value) + ": " + broken;
  return "";
}

}  // namespace lichthof
