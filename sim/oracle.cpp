#include "sim/oracle.hpp"

#include <algorithm>
#include <cmath>

#include "core/cell/cell_invariants.hpp"

namespace lichthof::sim {

namespace {
/// Received light is summed in single precision per element by the light, in double precision by the events.
constexpr double received_tolerance = 1e-4;
}  // namespace

Oracle::Oracle(std::shared_ptr<const CellGrid> grid, std::vector<const Cell*> cells, const Controller& controller)
    : grid_(std::move(grid)), cells_(std::move(cells)), controller_(controller),
      reported_received_w_(cells_.size(), 0.0) {}

void Oracle::observe(const Observation& observation) {
  if (!broken_.empty()) return;
  now_ = observation.now;
  if (const auto* cell = std::get_if<CellId>(&observation.machine)) observe_cell(*cells_.at(cell->value), observation);
  if (std::holds_alternative<ToController>(observation.machine) && observation.stepped)
    for (const Event& event : observation.stepped->events)
      if (std::holds_alternative<Converged>(event)) check_end();
}

void Oracle::observe_cell(const Cell& cell, const Observation& observation) {
  // Messages, counted here and by the cells.
  if (observation.accepted && std::holds_alternative<HemicubeMessage>(observation.accepted->message)) {
    if (on_the_wire_ == 0) fail("a message arrived that nobody sent");
    ++received_, --on_the_wire_;
  }
  if (observation.stepped) {
    observe_events(cell, *observation.stepped);
    for (const Envelope& envelope : observation.stepped->outbox)
      if (std::holds_alternative<HemicubeMessage>(envelope.message)) ++sent_, ++on_the_wire_;
  }
  if (sent_ != received_ + on_the_wire_) fail("messages sent differ from received + on the wire");
  if (const std::string broken = broken_cell_invariant(cell); !broken.empty()) fail(broken);

  const CellPower power = cell.light().power();
  const double received_w = sum_channels(power.received), reported_w = reported_received_w_[cell.id().value];
  const double scale = std::abs(received_w) + std::abs(sum_channels(power.shot)) + 1e-30;
  if (!(std::abs(received_w - reported_w) <= received_tolerance * scale))
    fail("cell " + std::to_string(cell.id().value) + " holds " + std::to_string(received_w) +
         " W received, its transfers reported " + std::to_string(reported_w) + " W");
}

void Oracle::observe_events(const Cell& cell, const Effects& effects) {
  for (const Event& event : effects.events) {
    if (const auto* fired = std::get_if<ShotFired>(&event)) {
      reported_received_w_[cell.id().value] += fired->received_w;
      if (fired->external) {
        observe_visit(fired->shot, cell.id());
        continue;
      }
      // The outbox carries the copy of the shooting patch; without one the zone is the cell itself.
      ++shots_;
      OpenShot open;
      for (const Envelope& envelope : effects.outbox)
        if (const auto* message = std::get_if<HemicubeMessage>(&envelope.message);
            message && message->shot->id == fired->shot)
          open.pose = pose_of(*grid_, *message->shot), open.zone = visible_zone(*grid_, open.pose).size();
      if (open.zone <= 1) continue;
      open.visited.insert(cell.id());
      if (!open_.emplace(fired->shot, std::move(open)).second) fail("a shot number was used twice");
    } else if (const auto* skipped = std::get_if<VisitSkipped>(&event)) {
      ++skipped_;
      observe_visit(skipped->shot, cell.id());
    } else if (const auto* joined = std::get_if<BitmapsJoined>(&event)) {
      ++joins_;
      most_joined_ = std::max<std::uint64_t>(most_joined_, joined->parts);
      if (joined->parts > grid_->dimensions()) fail("more bitmaps joined than the grid has divided axes");
    }
  }
}

void Oracle::observe_visit(ShotId id, CellId cell) {
  const auto found = open_.find(id);
  if (found == open_.end()) return fail("a finished or unknown shot reached cell " + std::to_string(cell.value));
  OpenShot& open = found->second;
  if (!in_visible_zone(*grid_, open.pose, cell)) fail("a shot reached a cell outside its visible zone");
  for (const CellId nearer : predecessors(*grid_, open.pose, cell))
    if (!open.visited.contains(nearer)) fail("cell " + std::to_string(cell.value) + " did not wait for a predecessor");
  if (!open.visited.insert(cell).second) fail("a shot reached cell " + std::to_string(cell.value) + " twice");
  if (open.visited.size() == open.zone) open_.erase(found);
}

void Oracle::check_end() {
  if (!open_.empty()) fail("converged while a shot was on its way");
  if (on_the_wire_ > 0) fail("converged while a message was on the wire");
  for (const Cell* cell : cells_) {
    if (!cell->idle()) fail("converged while cell " + std::to_string(cell->id().value) + " had work");
    if (cell->light().strongest().power_w > controller_.threshold_w())
      fail("converged while cell " + std::to_string(cell->id().value) + " was above the threshold");
  }
}

void Oracle::fail(const std::string& what) {
  if (broken_.empty()) broken_ = "at " + std::to_string(now_.ns) + " ns: " + what;
}

}  // namespace lichthof::sim
