/// What a person can type into the controller's shell: a line becomes commands, or one error that names what was expected.
/// Knows no terminal and no cluster.
///
///     nodes; jobs 12            # several on a line; the rest is a comment
///     submit "my room.obj" -o room.png --size 800x600
///
/// Words are separated by blanks; quotes of either kind and backslashes keep blanks, semicolons and # inside a word.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof {

enum class ShellVerb {
  nodes,
  jobs,
  submit,
  cancel,
  resume,
  watch,
  result,
  drain,
  kick,
  log,
  actors,
  methods,
  help,
  quit
};

struct ShellCommand {
  ShellVerb verb = ShellVerb::help;
  std::uint64_t job = 0;           ///< jobs cancel resume watch result log; 0: all (jobs only)
  std::string name;                ///< drain, kick: the node; help: a verb, or empty
  std::string file;                ///< result: where to
  bool on = true;                  ///< drain NODE off: takes work again
  std::vector<std::string> words;  ///< submit: the command line behind it
};

/// @returns  the commands of a line, in order; none for an empty one
/// @error    bad_input
Expected<std::vector<ShellCommand>> shell_commands(std::string_view line);

/// One line per command; or all about one. @error bad_input: no such command
Expected<std::string> shell_help(std::string_view verb = {});

/// What names there are just now.
struct ShellNames {
  std::vector<std::string> jobs, nodes;
};

struct Completion {
  std::size_t start = 0;                ///< where in the line the word to complete begins
  std::vector<std::string> candidates;  ///< whole words that begin with what stands there, in order
  bool files = false;                   ///< file names fit here too
};

/// @param line  up to the cursor
Completion completion(std::string_view line, const ShellNames& names);

}  // namespace lichthof
