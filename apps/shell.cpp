/// `lichthof shell`: the controller's command line, typed or from a script.
#include <unistd.h>

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include "apps/cluster/actions.hpp"
#include "apps/cluster/cluster_options.hpp"
#include "apps/cluster/line_editor.hpp"
#include "apps/cluster/tables.hpp"
#include "apps/commands.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"
#include "core/cluster/shell_language.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

constexpr std::size_t longest_line = 65536;

struct ShellOptions {
  std::string commands;
  bool has_commands = false;
  ClusterOptions cluster;
  OutputOptions talk;
};

/// Where earlier lines are kept; empty: nowhere.
std::string history_file() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state && *state == '/') return std::string(state) + "/lichthof/history";
  const char* home = std::getenv("HOME");
  return home && *home ? std::string(home) + "/.local/state/lichthof/history" : "";
}

class Shell {
 public:
  Shell(DeskClient client, const OutputOptions& talk, Interruption& interruption)
      : client_(std::move(client)), talk_(talk), interruption_(interruption) {}

  /// @returns the first error; what stood before it has been done
  Status obey(const std::string& line);
  Status obey_script(std::istream& script, const std::string& name);
  Status talk_with_person();
  bool is_left() const { return is_left_; }

 private:
  Status obey(const ShellCommand& command);
  Completion completed(const std::string& up_to_cursor) const;

  DeskClient client_;
  OutputOptions talk_;
  Interruption& interruption_;
  bool is_left_ = false;
};

Status Shell::obey(const ShellCommand& command) {
  switch (command.verb) {
    case ShellVerb::nodes:
      return show_nodes(client_, talk_);
    case ShellVerb::actors:
      return show_actors(client_, talk_);
    case ShellVerb::methods:
      return show_methods(client_, talk_);
    case ShellVerb::jobs:
      return command.job == 0 ? show_jobs(client_, talk_) : show_job(client_, command.job, talk_);
    case ShellVerb::log:
      return show_log(client_, command.job, talk_);
    case ShellVerb::submit:
      return submit_line(command.words, client_, talk_, interruption_);
    case ShellVerb::cancel:
      return cancel_job(client_, command.job, talk_);
    case ShellVerb::resume:
      return resume_job(client_, command.job, talk_);
    case ShellVerb::watch:
      return watch_job(client_, command.job, talk_, interruption_);
    case ShellVerb::result:
      return fetch_result(client_, command.job, command.file, std::nullopt, talk_);
    case ShellVerb::drain:
      return drain_node(client_, command.name, command.on, talk_);
    case ShellVerb::kick:
      return kick_node(client_, command.name, talk_);
    case ShellVerb::help: {
      std::string text = *shell_help(command.name);
      text.pop_back();
      return print(talk_, {{"help", text}}, {text});
    }
    case ShellVerb::quit:
      is_left_ = true;
      return Done{};
  }
  return Done{};
}

Status Shell::obey(const std::string& line) {
  const Expected<std::vector<ShellCommand>> commands = shell_commands(line);
  if (!commands) return commands.error();
  for (const ShellCommand& command : *commands) {
    if (is_left_) break;
    if (Status done = obey(command); !done) return done;
  }
  return Done{};
}

Status Shell::obey_script(std::istream& script, const std::string& name) {
  std::uint64_t number = 0;
  for (std::string line; !is_left_ && std::getline(script, line);) {
    ++number;
    if (line.size() > longest_line)
      return Error{ErrorCode::bad_input, io::at_line(name, number), "the line is too long"};
    const Status done = obey(line);
    if (!done) return Error{done.error().code, io::at_line(name, number), done.error().text()};
  }
  return Done{};
}

Completion Shell::completed(const std::string& up_to_cursor) const {
  ShellNames names;
  if (const Expected<nlohmann::json> jobs = client_.get("/v1/jobs"); jobs && jobs->is_array())
    for (const nlohmann::json& job : *jobs) names.jobs.push_back(io::printable(text_at(job, "id")));
  if (const Expected<nlohmann::json> nodes = client_.get("/v1/nodes"); nodes && nodes->is_array())
    for (const nlohmann::json& node : *nodes) names.nodes.push_back(io::printable(text_at(node, "name")));
  Completion found = completion(up_to_cursor, names);
  if (found.files)
    for (const std::string& file : files_beginning(up_to_cursor.substr(found.start))) found.candidates.push_back(file);
  return found;
}

Status Shell::talk_with_person() {
  std::setlocale(LC_CTYPE, "");
  const Interruption::Deferral deferral;
  LineEditor editor(
      history_file(), [this](const std::string& text) { return completed(text); },
      [this] { return interruption_.asked().load(); });
  std::printf("The cluster at %s; help lists the commands.\n", client_.address().host.c_str());
  while (!is_left_) {
    const std::optional<std::string> line = editor.line("lichthof> ");
    if (interruption_.asked()) return Error{ErrorCode::interrupted, "", "interrupted"};
    if (!line) {
      std::printf("\n");
      break;
    }
    if (const Status done = obey(*line); !done) std::fprintf(stderr, "lichthof: %s\n", done.error().text().c_str());
    interruption_.forget();
  }
  return Done{};
}

Status run_shell(const ShellOptions& options, Interruption& interruption) {
  log_as_asked(options.talk);
  Expected<DeskClient> client = desk_client(options.cluster);
  if (!client) return client.error();
  Shell shell(*client, options.talk, interruption);
  if (options.has_commands) return shell.obey(options.commands);
  if (::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO)) return shell.talk_with_person();
  return shell.obey_script(std::cin, "line");
}

}  // namespace

void add_shell(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ShellOptions>();
  CLI::App& command = *program.add_subcommand("shell", "the command line of a cluster");
  CLI::Option* commands = command.add_option("-c", options->commands, "do these commands, separated by semicolons")
                              ->option_text("COMMANDS");
  add_cluster_options(command, options->cluster);
  add_output_options(command, options->talk);
  command.footer("Commands:\n" + *shell_help() +
                 "\nA script ends at the first error, with its exit status. With --json each command prints a document "
                 "of its own.\n"
                 "\nExamples:\n"
                 "  lichthof shell --cluster lab7:7410\n"
                 "  lichthof shell -c \"nodes; jobs\"\n"
                 "  lichthof shell < evening.txt");
  command.callback([options, &chosen, commands] {
    options->has_commands = commands->count() > 0;
    chosen = [options](Interruption& interruption) { return run_shell(*options, interruption); };
  });
}

}  // namespace lichthof::apps
