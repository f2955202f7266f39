/// What a node has done since it started, for monitoring: written by its actor about once a second, read by any thread.
#pragma once

#include <atomic>
#include <cstdint>

namespace lichthof::actors {

struct NodeCounters {
  std::atomic<std::uint64_t> shots{0}, rays{0};                ///< of its cells and workers
  std::atomic<std::uint64_t> bytes_in{0}, bytes_out{0};        ///< from and to controller and other nodes
  std::atomic<std::uint64_t> yields{0};                        ///< times that it left for its owner's sake
  std::atomic<std::uint32_t> shares{0}, cells{0}, workers{0};  ///< hosted now
  std::atomic<bool> connected{false};                          ///< to its controller
  std::atomic<bool> working{true};                             ///< false: its owner is at the machine
};

}  // namespace lichthof::actors
