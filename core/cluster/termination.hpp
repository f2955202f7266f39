/// When a run has converged: every hemicube message that was sent has been processed and every cell is idle, seen twice.
///
/// One look is not enough: the reports of a wave are taken at different moments, and a message can slip from a cell not
/// yet asked to one asked already. A second wave, started after the first was complete, that finds the same counts in
/// every cell proves that nothing was under way between the two. This is exact; no clock is involved.
/// @source [Mattern87], the four-counter method
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/protocol/messages.hpp"

namespace lichthof {

class Termination {
 public:
  explicit Termination(std::uint32_t cells) : cells_(cells) {}

  /// Files a report, spontaneous or of a wave. Reports of one cell must arrive in the order they were made.
  /// @returns false for one that can not be: no such cell, counts that fall, a wave that was never started
  bool file(const CellReport& report);

  /// The wave to start now: once when all cells look idle and the counts balance, then again to confirm. The caller polls
  /// all cells with this number.
  std::optional<std::uint64_t> wave_to_start();

  /// Something came from outside (a change, a new threshold): what was seen so far proves nothing.
  void reset();

  /// By the latest reports all cells are idle and the counts balance: good enough to wait no longer, no proof of an end.
  bool looks_quiet() const;
  bool terminated() const { return terminated_; }
  std::uint64_t waves() const { return wave_; }
  /// Latest report of each cell; absent until its first one.
  const std::vector<std::optional<CellReport>>& latest() const { return latest_; }

 private:
  struct Counts {
    std::uint64_t sent = 0, processed = 0, shots = 0;
    bool operator==(const Counts&) const = default;
  };
  void finish_wave();

  std::uint32_t cells_;
  std::vector<std::optional<CellReport>> latest_ = std::vector<std::optional<CellReport>>(cells_);
  bool wave_under_way_ = false;
  std::uint64_t wave_ = 0;                      ///< number of the last wave started; 0: none yet
  std::uint64_t first_valid_wave_ = 1;          ///< older ones were started before a reset
  std::vector<std::optional<Counts>> answers_;  ///< to the wave under way
  bool answers_are_quiet_ = true;
  std::vector<Counts> confirmed_by_;  ///< counts of the quiet wave before; empty: none
  bool confirmation_is_due_ = false;
  bool terminated_ = false;
};

}  // namespace lichthof
