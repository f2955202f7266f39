/// How the actor system is set up. Options are given in code: no file and no command line of CAF's own is read.
#pragma once

#include <caf/all.hpp>

namespace lichthof::actors {

struct SystemOptions {
  unsigned threads = 1;  ///< of the scheduler; detached actors have their own
  /// Messages an actor deals with before another one gets the thread. 1: actors on one thread take turns step by step, so
  /// that no cell shoots far ahead of the light of the others. Must be finite, or a busy actor keeps its thread for ever.
  unsigned max_throughput = 1;
  bool network = false;  ///< CAF's multiplexer, for links (link/link.hpp); it opens no port of its own
};

/// Central queue: idle threads sleep instead of looking for work to steal, and a single thread serves the actors in the
/// order in which they got work.
class SystemConfig : public caf::actor_system_config {
 public:
  explicit SystemConfig(const SystemOptions& options = {});
};

}  // namespace lichthof::actors
