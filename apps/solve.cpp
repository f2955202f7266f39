/// `lichthof solve`: the first pass alone, from a scene or from where a solution stopped.
#include <spdlog/spdlog.h>

#include <memory>
#include <string>

#include "apps/accuracy.hpp"
#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/log.hpp"
#include "apps/pipeline.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

struct SolveCommand {
  RunOptions run;
  ErrorWish accuracy;
};

Status solve(const SolveCommand& command, const Interruption& interruption) {
  const RunOptions& options = command.run;
  log_as_asked(options.talk);
  // A solution may be continued in place: the older file stays until the new one is whole.
  const bool resumes = io::is_solution_file(options.input);
  if (Status ready = resumes ? output_ready(options.output, {}, {}) : output_ready(options.output, {}, {options.input});
      !ready)
    return ready;
  Run run("solve", options, Method::radiosity, interruption);
  if (Status loaded = run.load(true); !loaded) return loaded;
  if (resumes) {
    if (command.accuracy.error)
      return Error{ErrorCode::bad_input, "--error", options.input + " has its mesh already; solve the scene anew for another error"};
    if (Status solved = run.solve(); !solved) return solved;
    if (!command.accuracy.check) run.warn_of_ledger();
  }
  if (!resumes || command.accuracy.check)
    if (const auto reached = reach(run, command.accuracy, {Reading::as_it_is, surface_check_points, {}}, interruption);
        !reached)
      return reached.error();
  if (Status kept = run.keep(options.output); !kept) return kept;

  const RunRecord& record = run.record();
  const std::string done = options.output + ": " + (record.converged ? "solved" : "not solved to its end");
  if (Status printed = print(options.talk, json(record), summary(record, done)); !printed) return printed;
  if (run.converged()) return strictly(command.accuracy, run);
  return Error{ErrorCode::interrupted, "",
               "interrupted; the solution so far is kept, continue it with: lichthof solve " + options.output + " -o " +
                   options.output};
}

}  // namespace

void add_solve(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<SolveCommand>();
  CLI::App& command = *program.add_subcommand("solve", "compute the first pass alone, or continue it");
  command.add_option("SCENE", options->run.input, "a scene (.obj, .toml), or a solution to continue")
      ->required()
      ->option_text(" ");
  command.add_option("-o,--output", options->run.output, "the solution; may be the one that is continued")
      ->required()
      ->option_text("SOLUTION");
  add_method_option(command, options->run.method, {"radiosity", "two-pass", "hemicube"});
  add_error_options(command, options->accuracy, "each place's own irradiance over all surfaces");
  add_threads_option(command, options->run.threads);
  add_scene_options(command, options->run.read);
  add_first_pass_options(command, options->run.first_pass);
  add_output_options(command, options->run.talk);
  command.footer(
      "Methods: radiosity finds visibility by rays and bitmaps (two-pass is the same here), hemicube by the paper's "
      "item buffer.\n"
      "When interrupted, what was reached is kept; the exit status is 1.\n"
      "\nExamples:\n"
      "  lichthof solve room.obj -o room.lht\n"
      "  lichthof solve room.obj -o room.lht --unit mm --up y --cells 4x2 --elements 50000\n"
      "  lichthof solve room.obj -o room.lht --error 0.05\n"
      "  lichthof solve room.lht -o room.lht --eps 1e-4");
  command.callback(
      [options, &chosen] { chosen = [options](Interruption& interruption) { return solve(*options, interruption); }; });
}

}  // namespace lichthof::apps
