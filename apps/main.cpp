/// The one program `lichthof`: finds the command, runs it, turns its error into one line and an exit status.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"

namespace {

using namespace lichthof;
using namespace lichthof::apps;

constexpr int done = 0, failed = 1, bad_usage = 2;

int told(std::string message, int status) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::fprintf(stderr, "lichthof: %s\n", message.c_str());
  return status;
}

/// Diagnostics belong on stderr: stdout is for results.
void log_to_stderr() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("lichthof"));
  spdlog::set_pattern("lichthof: %^%l%$: %v");
  spdlog::set_level(spdlog::level::warn);
}

/// The innermost command that the line names, for hints: "lichthof render".
std::string command_line(const CLI::App& program) {
  const auto chosen = program.get_subcommands();
  return chosen.empty() ? "lichthof" : "lichthof " + chosen.front()->get_name();
}

int run(int argc, char** argv) {
  CLI::App program{
      "Global illumination of buildings: radiosity by progressive refinement, then a ray-traced second pass.\n"
      "Start with: lichthof render SCENE.obj -o IMAGE.png",
      "lichthof"};
  program.require_subcommand(1);
  program.set_version_flag("--version", LICHTHOF_VERSION_LINE, "print the version and exit");
  program.get_formatter()->column_width(28);
  program.footer(
      "lichthof COMMAND --help tells a command's options, with examples.\n"
      "Exit status: 0 done, 1 the job failed or was interrupted, 2 bad usage or bad input.");
  Command chosen;
  for (const auto add : {add_render, add_solve, add_probe, add_export, add_convert, add_viewfactors, add_doctor, add_bench,
                         add_keys, add_controller, add_node, add_submit, add_jobs, add_top, add_shell})
    add(program, chosen);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);  // --help, --version
    return told(std::string(error.what()) + " (see " + command_line(program) + " --help)", bad_usage);
  }
  Interruption interruption;
  const Status status = chosen(interruption);
  if (status) return done;
  return told(status.error().text(), status.error().code == ErrorCode::bad_input ? bad_usage : failed);
}

}  // namespace

int main(int argc, char** argv) {
  // A write beyond ulimit -f shall fail like one on a full disk, not kill the program.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    log_to_stderr();
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    return told("out of memory; a coarser mesh needs less (--patch, --elements)", failed);
  } catch (const std::exception& error) {
    return told(std::string("internal error: ") + error.what(), failed);
  }
}
