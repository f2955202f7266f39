/// `lichthof export`: a solution as a model for other programs.
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"
#include "io/model_writer.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

struct ExportOptions {
  std::string input, output;
  std::optional<double> exposure_ev;
  OutputOptions talk;
};

Status export_model(const ExportOptions& options) {
  const Stopwatch total;
  log_as_asked(options.talk);
  if (Status ready = output_ready(options.output, {".glb", ".ply", ".csv"}, {options.input}); !ready) return ready;
  const Expected<Solution> solution = io::read_solution(options.input);
  if (!solution) return solution.error();
  const double load_s = total.seconds();
  const Interruption::Deferral deferral;
  if (Status written = io::write_model(options.output, *solution, {options.exposure_ev}); !written) return written;
  const nlohmann::json document = {{"command", "export"},
                                   {"version", LICHTHOF_VERSION},
                                   {"input", options.input},
                                   {"output", options.output},
                                   {"elements", solution->mesh->elements.size()},
                                   {"patches", solution->mesh->patches.size()},
                                   {"converged", solution->converged},
                                   {"seconds", {{"load", load_s}, {"total", total.seconds()}}},
                                   {"peak_memory_bytes", peak_memory_bytes()}};
  return print(options.talk, document,
               {options.output + ": " + grouped(solution->mesh->elements.size()) + " elements"});
}

}  // namespace

void add_export(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App& command = *program.add_subcommand("export", "write a solution as a model for other programs");
  command.add_option("SOLUTION", options->input, "a solution, as written by: lichthof solve")
      ->required()
      ->option_text(" ");
  command.add_option("-o,--output", options->output, "the model: .glb .ply (vertex colours) or .csv (elements)")
      ->required()
      ->option_text("MODEL");
  add_exposure_option(command, options->exposure_ev, "the colours");
  add_output_options(command, options->talk);
  command.footer(
      ".glb: metres, y up, unlit vertex colours, radiosity as _RADIOSITY; .ply: scene units, colours and radiosity;\n"
      ".csv: one row an element with centre, normal, area (m²), irradiance and radiosity (W/m²), material.\n"
      "\nExamples:\n"
      "  lichthof export room.lht -o room.glb\n"
      "  lichthof export room.lht -o elements.csv");
  command.callback([options, &chosen] { chosen = [options](Interruption&) { return export_model(*options); }; });
}

}  // namespace lichthof::apps
