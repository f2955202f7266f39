#include "core/cluster/shell_language.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <system_error>

namespace lichthof {

namespace {

/// What stands behind a verb.
enum class Takes { nothing, maybe_job, job, result, node, node_and_switch, submit, maybe_verb };

struct Entry {
  ShellVerb verb;
  const char* name;
  Takes takes;
  const char* arguments;  ///< as help shows them
  const char* text;
};

constexpr std::array<Entry, 14> table{{
    {ShellVerb::nodes, "nodes", Takes::nothing, "", "the workstations, their state and load"},
    {ShellVerb::jobs, "jobs", Takes::maybe_job, "[ID]", "all jobs, or everything about one"},
    {ShellVerb::submit, "submit", Takes::submit, "SCENE [-o FILE] [OPTIONS]",
     "hand in a job; options as in lichthof submit --help"},
    {ShellVerb::cancel, "cancel", Takes::job, "ID", "end a job"},
    {ShellVerb::resume, "resume", Takes::job, "ID", "go on with a job that ended early"},
    {ShellVerb::watch, "watch", Takes::job, "ID", "follow a job to its end; Ctrl-C stops watching, not the job"},
    {ShellVerb::result, "result", Takes::result, "ID -o FILE",
     "fetch a result: .exr, .hdr, .png, or the solution as .lht"},
    {ShellVerb::drain, "drain", Takes::node_and_switch, "NODE [off]", "give a node no new work; off: again"},
    {ShellVerb::kick, "kick", Takes::node, "NODE", "part with a node at once; its work goes to others"},
    {ShellVerb::log, "log", Takes::job, "ID", "what happened to a job"},
    {ShellVerb::actors, "actors", Takes::nothing, "", "every actor and its load"},
    {ShellVerb::methods, "methods", Takes::nothing, "", "the ways light can be computed"},
    {ShellVerb::help, "help", Takes::maybe_verb, "[COMMAND]", "this list, or one command"},
    {ShellVerb::quit, "quit", Takes::nothing, "", "leave; jobs run on"},
}};

Error wrong(std::string message) { return {ErrorCode::bad_input, "", std::move(message)}; }

const Entry* entry_named(std::string_view name) {
  const auto found = std::find_if(table.begin(), table.end(), [&](const Entry& entry) { return name == entry.name; });
  return found == table.end() ? nullptr : &*found;
}

std::string usage(const Entry& entry) {
  return std::string(entry.name) + (*entry.arguments ? " " : "") + entry.arguments;
}

/// A word of the user inside quotes, printable and not long.
std::string quoted(std::string_view word) {
  std::string text(word.substr(0, 40));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  return "'" + text + (word.size() > 40 ? "..." : "") + "'";
}

// ---- Words ------------------------------------------------------------------------------------------------------------

struct Word {
  std::string text;
  std::size_t start = 0;
};

struct Split {
  std::vector<std::vector<Word>> commands{{}};
  char open_quote = 0;
  bool in_word = false;  ///< the line ends inside or right behind a word
  bool in_comment = false;
};

Split split(std::string_view line) {
  Split result;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    std::vector<Word>& words = result.commands.back();
    const auto put = [&](char character) {
      if (!result.in_word) words.push_back({{}, i});
      result.in_word = true;
      if (character) words.back().text += character;
    };
    if (result.open_quote) {
      if (c == result.open_quote)
        result.open_quote = 0;
      else if (c == '\\' && result.open_quote == '"' && i + 1 < line.size())
        put(line[++i]);
      else
        put(c);
    } else if (c == '\'' || c == '"') {
      put(0);
      result.open_quote = c;
    } else if (c == '\\' && i + 1 < line.size()) {
      put(line[i + 1]);
      ++i;
    } else if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
      result.in_word = false;
    } else if (c == ';') {
      result.in_word = false;
      result.commands.emplace_back();
    } else if (c == '#' && !result.in_word) {
      result.in_comment = true;
      break;
    } else {
      put(c);
    }
  }
  return result;
}

// ---- Commands ---------------------------------------------------------------------------------------------------------

Expected<std::uint64_t> job_in(const std::string& word, const Entry& entry) {
  std::uint64_t id = 0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), id);
  if (problem != std::errc() || end != word.data() + word.size() || id == 0)
    return wrong(quoted(word) + " is no job's number; expected: " + usage(entry));
  return id;
}

Expected<ShellCommand> command_from(const std::vector<Word>& words) {
  const Entry* entry = entry_named(words[0].text);
  if (!entry) return wrong("there is no command " + quoted(words[0].text) + "; help lists them");
  ShellCommand command;
  command.verb = entry->verb;
  const std::size_t given = words.size() - 1;
  const auto bounded = [&](std::size_t least, std::size_t most) { return given >= least && given <= most; };
  const Error expected = wrong("expected: " + usage(*entry));
  switch (entry->takes) {
    case Takes::nothing:
      if (given > 0)
        return wrong("nothing may follow " + std::string(entry->name) + ", but " + quoted(words[1].text) + " does");
      break;
    case Takes::maybe_job:
    case Takes::job: {
      if (!bounded(entry->takes == Takes::job, 1)) return expected;
      if (given == 0) break;
      const Expected<std::uint64_t> job = job_in(words[1].text, *entry);
      if (!job) return job.error();
      command.job = *job;
      break;
    }
    case Takes::result: {
      if (given != 3 || (words[2].text != "-o" && words[2].text != "--output") || words[3].text.empty())
        return expected;
      const Expected<std::uint64_t> job = job_in(words[1].text, *entry);
      if (!job) return job.error();
      command.job = *job;
      command.file = words[3].text;
      break;
    }
    case Takes::node:
    case Takes::node_and_switch:
      if (!bounded(1, entry->takes == Takes::node ? 1 : 2) || words[1].text.empty()) return expected;
      if (given == 2 && words[2].text != "off" && words[2].text != "on") return expected;
      command.name = words[1].text;
      command.on = given < 2 || words[2].text == "on";
      break;
    case Takes::submit:
      if (given == 0) return expected;
      for (std::size_t i = 1; i < words.size(); ++i) command.words.push_back(words[i].text);
      break;
    case Takes::maybe_verb:
      if (!bounded(0, 1)) return expected;
      if (given == 1) command.name = words[1].text;
      if (given == 1 && !entry_named(command.name))
        return wrong("there is no command " + quoted(command.name) + "; help lists them");
      break;
  }
  return command;
}

std::optional<std::string_view> without_prefix(std::string_view text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return std::nullopt;
  return text.substr(prefix.size());
}

/// A word as it must be typed.
std::string typed(const std::string& word) {
  if (word.find_first_of(" \t;#'\"\\") == std::string::npos) return word;
  std::string text;
  for (const char c : word) text += std::string(c == '"' || c == '\\' ? "\\" : "") + c;
  return "\"" + text + "\"";
}

}  // namespace

Expected<std::vector<ShellCommand>> shell_commands(std::string_view line) {
  if (line.find('\0') != std::string_view::npos) return wrong("a line holds text, but this one has a zero byte");
  const Split parts = split(line);
  if (parts.open_quote) return wrong(std::string("a closing ") + parts.open_quote + " is missing");
  std::vector<ShellCommand> commands;
  for (const std::vector<Word>& words : parts.commands) {
    if (words.empty()) continue;
    Expected<ShellCommand> command = command_from(words);
    if (!command) return command.error();
    commands.push_back(std::move(*command));
  }
  return commands;
}

Expected<std::string> shell_help(std::string_view verb) {
  if (!verb.empty()) {
    const Entry* entry = entry_named(verb);
    if (!entry) return wrong("there is no command " + quoted(verb) + "; help lists them");
    return usage(*entry) + "\n  " + entry->text + "\n";
  }
  std::string text;
  for (const Entry& entry : table) {
    std::string line = usage(entry);
    line.resize(std::max<std::size_t>(28, line.size() + 2), ' ');
    text += line + entry.text + "\n";
  }
  return text;
}

Completion completion(std::string_view line, const ShellNames& names) {
  const Split parts = split(line);
  const std::vector<Word>& words = parts.commands.back();
  Completion result;
  result.start = parts.in_word ? words.back().start : line.size();
  if (parts.in_comment) return result;
  const std::string begun = parts.in_word ? words.back().text : "";
  const std::size_t before = words.size() - (parts.in_word ? 1 : 0);  // whole words in front
  const auto offer = [&](const std::vector<std::string>& words_that_fit) {
    for (const std::string& word : words_that_fit)
      if (without_prefix(word, begun)) result.candidates.push_back(typed(word));
  };
  std::vector<std::string> verbs;
  for (const Entry& entry : table) verbs.push_back(entry.name);
  if (before == 0) {
    offer(verbs);
    return result;
  }
  const Entry* entry = entry_named(words[0].text);
  if (!entry) return result;
  const bool needs_job =
      entry->takes == Takes::job || entry->takes == Takes::maybe_job || entry->takes == Takes::result;
  const bool needs_node = entry->takes == Takes::node || entry->takes == Takes::node_and_switch;
  if (before == 1 && needs_job) offer(names.jobs);
  if (before == 1 && needs_node) offer(names.nodes);
  if (before == 1 && entry->takes == Takes::maybe_verb) offer(verbs);
  if (before == 2 && entry->takes == Takes::node_and_switch) offer({"off", "on"});
  if (before == 2 && entry->takes == Takes::result) offer({"-o"});
  result.files =
      (entry->takes == Takes::result && before == 3) || (entry->takes == Takes::submit && !begun.starts_with('-'));
  if (entry->takes == Takes::submit && before > 1)
    offer({"--camera", "--cells", "--elements", "--eps", "--exposure", "--gather", "--method", "--patch", "--samples",
           "--size", "--solution", "--title", "--wait", "-o"});
  return result;
}

}  // namespace lichthof
