#include "core/cluster/controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.hpp"
#include "core/protocol/plausible_change.hpp"

namespace lichthof {

namespace {
/// No patch is this bright: with it as threshold every cell rests as soon as the shots under way have arrived.
constexpr double nobody_shoots = std::numeric_limits<double>::infinity();
/// The first level, as a share of the largest initial power, and how much lower the next one is. Measured in decisions/0015.
constexpr double first_level_share = 1.0 / 64, level_ratio = 2;
}  // namespace

Controller::Controller(const ControllerOptions& options)
    : options_(options), initial_power_w_(options.cells), termination_(options.cells) {
  MUST(options.cells >= 1 && options.eps > 0);
}

// ---- Filing -----------------------------------------------------------------------------------------------------------

void Controller::accept(const Envelope& envelope, Instant) {
  const auto* sender = std::get_if<CellId>(&envelope.from);
  if (const auto* ready = std::get_if<CellReady>(&envelope.message); ready && sender && *sender == ready->cell)
    accept(*ready);
  else if (const auto* report = std::get_if<CellReport>(&envelope.message);
           report && sender && *sender == report->cell) {
    if (report->epoch != options_.epoch || finished()) return;
    if (!termination_.file(*report)) refused_.push_back(report->cell);
    const bool may_end = phase_ == RunPhase::draining || level_w_ <= threshold_w_;
    if (!wave_is_due_ && may_end) wave_is_due_ = termination_.wave_to_start();
  } else if (const auto* change = std::get_if<GeometryChange>(&envelope.message); change && !sender)
    accept(*change);
  else
    refused_.push_back(sender ? *sender : CellId{});
}

void Controller::accept(const CellReady& ready) {
  const bool is_plausible = ready.cell.value < options_.cells && std::isfinite(ready.largest_initial_power_w) &&
                            ready.largest_initial_power_w >= 0;
  if (!is_plausible || initial_power_w_[ready.cell.value]) return refused_.push_back(ready.cell);
  initial_power_w_[ready.cell.value] = ready.largest_initial_power_w;
  largest_initial_power_w_ = std::max(largest_initial_power_w_, ready.largest_initial_power_w);
  const bool all_are_ready =
      std::all_of(initial_power_w_.begin(), initial_power_w_.end(), [](const auto& p) { return p.has_value(); });
  if (!all_are_ready || phase_ != RunPhase::gathering) return;
  threshold_w_ = options_.eps * largest_initial_power_w_;
  level_w_ = first_level();
  start_is_due_ = true;
}

void Controller::accept(const GeometryChange& change) {
  if (interrupted_ || stop_is_due_ || !plausible(change)) return refused_.push_back(CellId{});
  changes_.push_back({SceneVersion{++version_.value}, change.change});
  // A cell that has been stopped applies nothing: a converged run starts again. So do its levels: light may be strong again.
  if (!finished()) return;
  level_w_ = first_level();
  start_is_due_ = true;
}

void Controller::stop(Stop how) {
  if (finished() && !start_is_due_) return;
  if (!stop_is_due_ || how == Stop::at_once) stop_is_due_ = how;
}

void Controller::go_on() {
  if (!finished()) return;
  interrupted_ = false;
  start_is_due_ = true;
}

void Controller::refresh_progress() {
  if (phase_ == RunPhase::radiosity || phase_ == RunPhase::draining) progress_is_due_ = true;
}

// ---- Levels -----------------------------------------------------------------------------------------------------------

double Controller::first_level() const {
  return options_.cells == 1 ? threshold_w_ : std::max(threshold_w_, first_level_share * largest_initial_power_w_);
}

bool Controller::next_level_is_due() const {
  return phase_ == RunPhase::radiosity && level_w_ > threshold_w_ && termination_.looks_quiet();
}

void Controller::begin_level(Effects& effects) {
  to_all_cells(StartRadiosity{options_.epoch, level_w_}, effects);
  termination_.reset();
}

// ---- Leading ----------------------------------------------------------------------------------------------------------

bool Controller::has_work() const {
  return start_is_due_ || progress_is_due_ || stop_is_due_ || !changes_.empty() || wave_is_due_ || !refused_.empty() ||
         (!finished() && (termination_.terminated() || next_level_is_due()));
}

Effects Controller::step(Instant) {
  MUST(has_work());
  Effects effects;
  for (const CellId cell : refused_) effects.events.push_back(MessageRefused{cell});
  refused_.clear();

  // What comes from outside first: it voids what the waves have seen so far.
  if (!changes_.empty() || start_is_due_) {
    for (const GeometryChange& change : changes_) to_all_cells(change, effects);
    changes_.clear();
    if (start_is_due_) phase_ = RunPhase::radiosity, begin_level(effects);
    start_is_due_ = false;
    termination_.reset();
  }
  if (stop_is_due_) carry_out_stop(effects);
  if (finished()) return effects;

  if (next_level_is_due()) {
    // Levels at which nobody would shoot are passed over.
    level_w_ = std::max(threshold_w_, std::min(level_w_, progress().strongest_w) / level_ratio);
    begin_level(effects);
  }
  if (termination_.terminated()) {
    finish(effects);
    return effects;
  }
  if (progress_is_due_) to_all_cells(PollCell{options_.epoch, 0}, effects);
  progress_is_due_ = false;
  if (wave_is_due_) to_all_cells(PollCell{options_.epoch, *wave_is_due_}, effects);
  wave_is_due_.reset();
  return effects;
}

void Controller::carry_out_stop(Effects& effects) {
  const Stop how = *stop_is_due_;
  stop_is_due_.reset();
  interrupted_ = true;
  // Cells that have not started have nothing under way.
  if (how == Stop::at_once || phase_ == RunPhase::gathering) return finish(effects);
  if (phase_ == RunPhase::draining) return;
  phase_ = RunPhase::draining;
  to_all_cells(StartRadiosity{options_.epoch, nobody_shoots}, effects);
  termination_.reset();
}

void Controller::finish(Effects& effects) {
  phase_ = RunPhase::finished;
  progress_is_due_ = false;
  wave_is_due_.reset();
  to_all_cells(StopRadiosity{options_.epoch}, effects);
  if (!interrupted_) effects.events.push_back(Converged{progress().shots});
}

void Controller::to_all_cells(const Message& message, Effects& effects) const {
  for (std::uint32_t cell = 0; cell < options_.cells; ++cell)
    effects.outbox.push_back({ToController{}, CellId{cell}, message});
}

RadiosityProgress Controller::progress() const {
  RadiosityProgress progress;
  progress.phase = phase_;
  progress.cells = options_.cells;
  progress.waves = termination_.waves();
  progress.largest_initial_power_w = largest_initial_power_w_;
  progress.threshold_w = threshold_w_;
  for (const auto& power : initial_power_w_) progress.cells_ready += power.has_value();
  for (const auto& report : termination_.latest()) {
    if (!report) continue;
    progress.cells_idle += report->idle;
    progress.shots += report->shots;
    progress.messages_sent += report->messages_sent;
    progress.messages_processed += report->messages_processed;
    progress.strongest_w = std::max(progress.strongest_w, report->strongest_w);
    progress.unshot_w += report->unshot_w;
    progress.emitted_w += report->emitted_w;
  }
  return progress;
}

}  // namespace lichthof
