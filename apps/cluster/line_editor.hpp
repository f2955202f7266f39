/// A line typed at a terminal, with editing, history and completion (libedit). Everything of the library is behind this class.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/cluster/shell_language.hpp"

namespace lichthof::apps {

class LineEditor {
 public:
  using Completer = std::function<Completion(const std::string& up_to_cursor)>;
  using Stop = std::function<bool()>;

  /// @param history  file of earlier lines, read and written with mode 0600; empty: none is kept
  /// @param stop     asked often while nothing is typed
  LineEditor(const std::string& history, Completer completer, Stop stop);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;

  /// @returns none at the end: Ctrl-D, the terminal has gone, or stop
  std::optional<std::string> line(const std::string& prompt);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Names of files that begin so, folders with a slash behind.
std::vector<std::string> files_beginning(const std::string& start);

}  // namespace lichthof::apps
