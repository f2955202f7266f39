/// SIGINT and SIGTERM: the first asks a pass under way to stop and to keep what it has, the second ends the program at
/// once. Where nothing could be kept, the first ends it too.
#pragma once

#include <atomic>

namespace lichthof::apps {

class Interruption {
 public:
  /// Blocks both signals in this thread, hence in all it starts, and waits for them in a thread of its own.
  /// @pre called once, before any other thread exists
  Interruption();
  Interruption(const Interruption&) = delete;

  /// Raised by the first signal while a Deferral lives.
  const std::atomic<bool>& asked() const;

  /// Takes back what SIGINT asked for: a person's Ctrl-C ended one command of a shell, not the shell. SIGTERM stays.
  void forget();

  /// Lives while somebody looks at asked() often, or while a file is being written.
  class Deferral {
   public:
    Deferral();
    ~Deferral();
    Deferral(const Deferral&) = delete;
  };
};

}  // namespace lichthof::apps
