/// The commands of `lichthof`. Each of these functions adds one subcommand with its options and help to the program; when
/// the command line names it, `chosen` becomes what is to be run.
#pragma once

#include <CLI/CLI.hpp>

#include "apps/common/options.hpp"

namespace lichthof::apps {

void add_render(CLI::App& program, Command& chosen);
void add_solve(CLI::App& program, Command& chosen);
void add_probe(CLI::App& program, Command& chosen);
void add_export(CLI::App& program, Command& chosen);
void add_convert(CLI::App& program, Command& chosen);
void add_viewfactors(CLI::App& program, Command& chosen);
void add_doctor(CLI::App& program, Command& chosen);
void add_bench(CLI::App& program, Command& chosen);
void add_keys(CLI::App& program, Command& chosen);
void add_controller(CLI::App& program, Command& chosen);
void add_node(CLI::App& program, Command& chosen);
void add_submit(CLI::App& program, Command& chosen);
void add_jobs(CLI::App& program, Command& chosen);
void add_top(CLI::App& program, Command& chosen);
void add_shell(CLI::App& program, Command& chosen);

}  // namespace lichthof::apps
