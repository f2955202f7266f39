/// One line per pass on a terminal, rewritten in place; nothing where nobody watches.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "core/cluster/controller.hpp"

namespace lichthof::apps {

class ProgressLine {
 public:
  /// @param wanted  false: --quiet; the line also stays away when stderr is no terminal
  /// @param before  what each line begins with
  explicit ProgressLine(bool wanted, std::string before = {});
  /// Leaves the last state standing and ends the line.
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;

  // All may be called from any thread.
  void show(const RadiosityProgress& progress);
  void show(double share_done);
  /// @param what  "job 3 radiosity"
  void show(const std::string& what, double share_done);

 private:
  double elapsed_s() const;
  void rewrite(const std::string& text);

  bool shown_;
  std::string before_;
  std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  bool written_ = false;
};

/// Share of the way to the threshold, in [0, 1]: unshot power falls about exponentially with the work done.
double share_of_way(const RadiosityProgress& progress);

/// "12 s", "3 min 20 s", "2 h 05 min".
std::string duration_text(double seconds);

}  // namespace lichthof::apps
