/// What a first pass shows of itself while it is under way. Looking sends no message, so it can not change the order of the
/// steps: whoever wants to know asks, and each cell posts its figures after its next step.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "core/cluster/controller.hpp"

namespace lichthof::actors {

class Board {
 public:
  explicit Board(std::uint32_t cells) : reports_(cells) {}

  /// Wants fresh figures. They are there a step later.
  void ask() { asked_.fetch_add(1, std::memory_order_relaxed); }
  /// Whether somebody has asked since the last call with the same `seen`.
  bool is_asked(std::uint64_t& seen) const {
    const std::uint64_t asked = asked_.load(std::memory_order_relaxed);
    if (asked == seen) return false;
    seen = asked;
    return true;
  }

  void post(const CellReport& report);
  /// Phase, threshold and waves; the sums over the cells are made here.
  void post(const RadiosityProgress& lead);
  RadiosityProgress progress() const;

 private:
  std::atomic<std::uint64_t> asked_{0};
  mutable std::mutex mutex_;
  RadiosityProgress lead_;
  std::vector<CellReport> reports_;
};

}  // namespace lichthof::actors
