/// Every message of the system as a plain value. Machines exchange nothing else; the actors' wire form is made of these.
#pragma once

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "core/base/ids.hpp"
#include "core/light/cell_light.hpp"

namespace lichthof {

// ---- First pass, cell to cell (§2) ------------------------------------------------------------------------------------

/// Bitmap plus copy of the shot, along one step of the routing (Fig. 4).
struct HemicubeMessage {
  std::shared_ptr<const Shot> shot;    ///< immutable, shared inside a process
  CellId from;
  /// No free pixel can reach the addressed cell or any behind it. The message is sent all the same: joins count on it.
  bool closed = false;
  std::vector<std::uint8_t> bitmap;    ///< packed(); empty when closed
};

// ---- First pass, controller and cells ---------------------------------------------------------------------------------

/// Begin shooting down to `threshold_w`, the power below which a group rests.
struct StartRadiosity {
  Epoch epoch;
  double threshold_w = 0;
};

/// A cell's largest initial power, so that the controller can fix the common threshold: eps × the largest of all.
struct CellReady {
  CellId cell;
  double largest_initial_power_w = 0;
};

/// What a cell has sent and processed; sent whenever it falls idle and when asked. See core/cluster/termination.
struct CellReport {
  CellId cell;
  Epoch epoch;
  std::uint64_t wave = 0;              ///< of the poll it answers; 0: spontaneous, on falling idle
  bool idle = false;
  std::uint64_t messages_sent = 0;     ///< hemicube messages
  std::uint64_t messages_processed = 0;
  std::uint64_t shots = 0;             ///< local shooting iterations
  double strongest_w = 0;              ///< power of the strongest waiting shooter
  Rgb unshot_w{0.0}, emitted_w{0.0};   ///< for progress
};

struct PollCell {
  Epoch epoch;
  std::uint64_t wave = 0;
};

/// Stop where you are (interrupted, or converged); finish nothing.
struct StopRadiosity {
  Epoch epoch;
};

// ---- Scene changes (§2.1) ---------------------------------------------------------------------------------------------

struct SetEmission {
  std::uint32_t material = 0;
  Rgb radiance{0.0};
};
struct SetReflectance {
  std::uint32_t material = 0;
  Rgb reflectance{0.0};
};
/// One numbered change; every cell gets every change, in any order of arrival, and applies them in order of version.
struct GeometryChange {
  SceneVersion version;
  std::variant<SetEmission, SetReflectance> change;
};

// ---- Second pass (§3) -------------------------------------------------------------------------------------------------

/// A contiguous range of screen columns [first, last).
struct ColumnJob {
  std::uint32_t first = 0, last = 0;
  std::uint32_t size() const { return last - first; }
};
struct JobRequest {
  WorkerId worker;
};
struct JobAssignment {
  ColumnJob job;
  bool no_more = false;                ///< all columns are handed out: rest
};
/// Finished columns: linear RGB radiance, column by column, top to bottom.
struct ColumnResult {
  WorkerId worker;
  ColumnJob job;
  std::vector<Rgbf> pixels;
  std::vector<std::uint64_t> rays;     ///< traced for each column: one that comes twice counts once
  double seconds = 0;                  ///< filled in by the driver, which has a clock
};
struct WorkerLost {
  WorkerId worker;
};

using Message = std::variant<HemicubeMessage, StartRadiosity, CellReady, CellReport, PollCell, StopRadiosity, GeometryChange,
                             JobRequest, JobAssignment, ColumnResult, WorkerLost>;

}  // namespace lichthof
