/// All cores of a machine work inside one step through this one function; nothing else in core knows of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lichthof {

/// A fixed number of threads (oneTBB arena). The caller's thread is one of them, so `threads = 1` starts none.
class Parallel {
 public:
  /// @param threads  ≥ 1
  explicit Parallel(unsigned threads);
  ~Parallel();
  Parallel(const Parallel&) = delete;
  Parallel& operator=(const Parallel&) = delete;

  unsigned threads() const { return threads_; }

  /// Calls task(i) for every i in [0, count), each once, in any order, at the same time on different threads.
  /// Results must not depend on that order: a task writes only what belongs to its index.
  /// @cost  about 5 µs to wake the other threads; with one thread a plain loop
  void for_each(std::size_t count, const std::function<void(std::size_t)>& task) const;

 private:
  struct Arena;
  unsigned threads_;
  std::unique_ptr<Arena> arena_;
};

}  // namespace lichthof
