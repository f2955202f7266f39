/// The machine that leads the first pass of a run: it fixes the threshold, starts the cells, detects the end, stops them.
///
///     gathering ──all CellReady──► radiosity ──termination──► finished (converged)
///         │                          │ ▲ │
///         │                 GeometryChange │ stop(after_pending)
///         │                                ▼
///         └─────stop──────────────────► draining ──termination──► finished (interrupted)
///
/// Many cells go down to the threshold by levels: who has nothing above the level waits, and when nothing is left above it
/// anywhere, it is halved. Each on its own, cells would shoot every trickle of light that comes in before it has gathered.
///
/// It moves on messages alone and knows no time. A run of one cell takes the same path.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/cluster/termination.hpp"
#include "core/protocol/effects.hpp"

namespace lichthof {

struct ControllerOptions {
  std::uint32_t cells = 1;
  double eps = 5e-4;  ///< threshold = eps × largest initial power of a group (§5)
  Epoch epoch;        ///< messages of another one are dropped
};

enum class RunPhase : std::uint8_t { gathering, radiosity, draining, finished };

/// How an interrupted run ends.
enum class Stop : std::uint8_t {
  after_pending,  ///< nobody shoots any more, but shots under way arrive everywhere: the energy ledger balances and the
                  ///< solution can be resumed; takes about one external iteration per waiting shot
  at_once,        ///< what is under way is lost
};

/// Sums over the latest report of each cell: as old as those are.
struct RadiosityProgress {
  RunPhase phase = RunPhase::gathering;
  std::uint32_t cells = 0, cells_ready = 0, cells_idle = 0;
  std::uint64_t shots = 0, messages_sent = 0, messages_processed = 0, waves = 0;
  double largest_initial_power_w = 0, threshold_w = 0;
  double strongest_w = 0;  ///< strongest waiting shooter of all cells
  Rgb unshot_w{0.0}, emitted_w{0.0};
};

class Controller {
 public:
  explicit Controller(const ControllerOptions& options);

  /// Takes CellReady and CellReport from cells, and GeometryChange from clients: its version is replaced by the next
  /// number, then it goes to every cell; a converged run starts again.
  void accept(const Envelope& envelope, Instant now);
  bool has_work() const;
  Effects step(Instant now);

  /// Ends the run early; the next steps carry it out. A second call may only hasten it. No effect on a finished run.
  void stop(Stop how);
  /// Starts a finished run again where it stopped; no effect on any other.
  void go_on();
  /// Asks every cell for a report, so that progress() becomes fresh. The driver calls it as often as it shows progress.
  void refresh_progress();

  RunPhase phase() const { return phase_; }
  bool finished() const { return phase_ == RunPhase::finished; }
  bool converged() const { return finished() && !interrupted_; }
  double threshold_w() const { return threshold_w_; }
  double level_w() const { return level_w_; }
  SceneVersion version() const { return version_; }
  RadiosityProgress progress() const;
  const Termination& termination() const { return termination_; }

 private:
  void accept(const CellReady& ready);
  void accept(const GeometryChange& change);
  double first_level() const;
  bool next_level_is_due() const;
  void begin_level(Effects& effects);
  void to_all_cells(const Message& message, Effects& effects) const;
  void finish(Effects& effects);
  void carry_out_stop(Effects& effects);

  ControllerOptions options_;
  RunPhase phase_ = RunPhase::gathering;
  bool interrupted_ = false;
  std::vector<std::optional<double>> initial_power_w_;  ///< per cell, once ready
  double largest_initial_power_w_ = 0, threshold_w_ = 0;
  double level_w_ = 0;  ///< who is below it rests for now
  SceneVersion version_;
  Termination termination_;

  // Filed, to be carried out by the next step.
  bool start_is_due_ = false;
  bool progress_is_due_ = false;
  std::optional<Stop> stop_is_due_;
  std::vector<GeometryChange> changes_;
  std::optional<std::uint64_t> wave_is_due_;
  std::vector<CellId> refused_;
};

}  // namespace lichthof
