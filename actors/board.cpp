#include "actors/board.hpp"

#include <algorithm>

namespace lichthof::actors {

void Board::post(const CellReport& report) {
  const std::lock_guard lock(mutex_);
  reports_[report.cell.value] = report;
}

void Board::post(const RadiosityProgress& lead) {
  const std::lock_guard lock(mutex_);
  lead_ = lead;
}

RadiosityProgress Board::progress() const {
  const std::lock_guard lock(mutex_);
  RadiosityProgress progress = lead_;
  progress.cells = static_cast<std::uint32_t>(reports_.size());
  progress.cells_idle = 0;
  progress.shots = progress.messages_sent = progress.messages_processed = 0;
  progress.strongest_w = 0;
  progress.unshot_w = progress.emitted_w = Rgb{0.0};
  for (const CellReport& report : reports_) {
    progress.cells_idle += report.idle;
    progress.shots += report.shots;
    progress.messages_sent += report.messages_sent;
    progress.messages_processed += report.messages_processed;
    progress.strongest_w = std::max(progress.strongest_w, report.strongest_w);
    progress.unshot_w += report.unshot_w;
    progress.emitted_w += report.emitted_w;
  }
  return progress;
}

}  // namespace lichthof::actors
