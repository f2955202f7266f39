/// The cell of §2 as a machine: it alone knows in which order a cell works.
///
/// One step is at most one unit of work: a scene change first, else the stronger of the strongest waiting external shot
/// and the strongest local patch. Polls of the controller are answered in whatever step comes next.
///
///     resting ──StartRadiosity──► running ──StopRadiosity──► resting
///
/// While resting everything is filed and nothing is worked on. Messages on their way:
///
///     local shot      take_shot → receive → project → HemicubeMessage to each successor
///     external shot   join of all predecessors → receive (unless covered) → project → HemicubeMessage to each successor
///
/// A cell that is alone in its grid has no successors: it makes no bitmap and sends no hemicube message.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/cell/bitmap_join.hpp"
#include "core/cell/geometry_queue.hpp"
#include "core/cell/light_of_cell.hpp"
#include "core/cell/shooter_queue.hpp"
#include "core/protocol/effects.hpp"

namespace lichthof {

struct CellOptions {
  std::uint32_t hemicube_resolution = 128;
  std::size_t waiting_limit = 256;  ///< external shots; see ShooterQueue
  Epoch epoch;                      ///< messages of another one are dropped
};

class Cell {
 public:
  /// @param grid   the same for all cells of a run
  /// @param light  of this cell
  Cell(CellId id, std::shared_ptr<const CellGrid> grid, std::unique_ptr<LightOfCell> light, const CellOptions& options);

  /// Files the message; computes no light and sends nothing. What can not be is refused: step() then reports it.
  void accept(const Envelope& envelope, Instant now);
  bool has_work() const;
  /// One unit of work. The first one announces the cell (CellReady); a step after which nothing is left to do ends with
  /// the spontaneous CellReport of falling idle.
  /// @pre has_work()
  Effects step(Instant now);

  CellId id() const { return id_; }
  const LightOfCell& light() const { return *light_; }
  /// What this cell did; the sum over the cells is the run's. `shots` counts local ones, `messages` those sent.
  const SolveCounters& counters() const { return counters_; }
  SceneVersion version() const { return geometry_.version(); }
  bool running() const { return running_; }
  /// Nothing to work on until a message comes; a resting cell is idle.
  bool idle() const;
  /// While held no patch of this cell shoots: the way to other cells is full. Shots of others are finished all the same, so
  /// that cells that hold each other up come free.
  void hold(bool is_held) { held_ = is_held; }

  /// A look inside for invariants, tests and monitoring.
  struct State {
    std::uint64_t sent = 0;           ///< hemicube messages
    std::uint64_t received = 0;       ///< hemicube messages, refused ones included
    std::uint64_t processed = 0;      ///< of those: shot finished, or refused
    std::uint64_t refused = 0;        ///< messages of any kind
    std::uint64_t waiting_parts = 0;  ///< in joins that are not complete
    std::uint64_t queued_parts = 0;   ///< in shots ready to be received
    std::uint64_t local_shots = 0, external_shots = 0;
    std::uint32_t most_joined = 0;  ///< largest number of bitmaps one join combined
  };
  State state() const;
  /// Light, joins and queues of this cell (bytes). @cost one look at every shot that waits here
  std::size_t memory_bytes() const { return light_->memory_bytes() + join_.memory_bytes() + queue_.memory_bytes(); }
  const BitmapJoin& join() const { return join_; }
  const CellGrid& grid() const { return *grid_; }

 private:
  void accept(const HemicubeMessage& message, const Address& from);
  void accept(const StartRadiosity& message);
  void accept(const PollCell& message);
  void accept(const StopRadiosity& message);
  void accept(const GeometryChange& message);
  void refuse(const ShotFault& fault = {});

  void apply_change(Effects& effects);
  void shoot_locally(Effects& effects);
  void receive_external(Effects& effects);
  void send_on(const std::shared_ptr<const Shot>& shot, const ShooterPose& pose, const HemicubeBitmap& bitmap,
               Effects& effects);
  void send_closed(const std::shared_ptr<const Shot>& shot, const ShooterPose& pose, Effects& effects);
  void send(HemicubeMessage message, CellId to, Effects& effects);
  void count(const TransferWork& work, Effects& effects);
  CellReport report(std::uint64_t wave) const;
  void report_where_asked(Effects& effects);
  NextShooter next_shooter(bool is_held) const {
    return queue_.next(is_held ? 0 : strongest_.power_w, threshold_w_, geometry_.version());
  }

  CellId id_;
  std::shared_ptr<const CellGrid> grid_;
  std::unique_ptr<LightOfCell> light_;
  CellOptions options_;
  BitmapJoin join_;
  ShooterQueue queue_;
  GeometryQueue geometry_;

  bool announced_ = false;
  bool running_ = false;
  bool held_ = false;
  bool reported_idle_ = false;  ///< since the last unit of work
  double threshold_w_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::vector<std::uint64_t> polls_;  ///< waves to answer
  std::uint64_t newly_refused_ = 0;   ///< since the last step
  ShotFault last_fault_;              ///< of the shot refused last
  State state_;
  SolveCounters counters_;
  CellLight::Candidate strongest_;  ///< of the light as the last step left it
};

}  // namespace lichthof
