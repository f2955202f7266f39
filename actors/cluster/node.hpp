/// A node of a lab: the daemon on a workstation. It dials its controller until it gets through, says what it can do, hosts
/// what it is told to, and lets go of everything when the controller is gone.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "actors/cluster/blob_cache.hpp"
#include "actors/cluster/cluster_messages.hpp"
#include "actors/cluster/node_counters.hpp"
#include "actors/link/link.hpp"
#include "core/light/solution.hpp"

namespace lichthof::actors {

struct NodeOptions {
  LinkOptions link;
  std::string listen_host = "127.0.0.1";  ///< where other nodes reach this one
  std::uint16_t listen_port = 0;          ///< 0: any
  std::string lead_host;
  std::uint16_t lead_port = 0;
  Registration facts;
  unsigned threads = 1;  ///< of a step of a cell
  std::string cache;     ///< folder for what the controller hands out
  std::uint64_t cache_bytes = 8ull << 30;
  std::function<Expected<Solution>(const std::string& path)> read_solution;
  std::function<std::uint64_t()> free_memory_bytes, used_memory_bytes;
  /// Called when the node has ended but for a thread that still loads a run, which nothing can interrupt. It may end the
  /// process; without it, or if it returns, that thread is waited for.
  std::function<void()> abandon;
  /// Asked twice a second: false while the node shall not work, for its owner is at the machine. None: it always may.
  std::function<bool()> may_work;
  std::shared_ptr<NodeCounters> counters = std::make_shared<NodeCounters>();
};

/// Runs until `stop` is set. A node that stops, or may not work, takes its leave: its jobs go on elsewhere and do not count
/// it as one they killed. When it may work again it joins again.
/// @error bad_input, io: it could not begin: keys, address, cache. Afterwards nothing ends it but `stop`
Status run_node(const NodeOptions& options, const std::atomic<bool>& stop);

}  // namespace lichthof::actors
