/// `lichthof bench`: figures of this machine, as ratios measured in one run, beside the project's goals for them.
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"
#include "bench/sections.hpp"
#include "core/base/check.hpp"
#include "io/scene_reader.hpp"

namespace lichthof::apps {

namespace {

namespace fs = std::filesystem;

struct BenchCommand {
  std::string section = "all";
  std::string scene;
  unsigned repeat = 3;
  io::ReadOptions read;
  OutputOptions talk;
};

using Measured = Expected<bench::Section> (*)(const bench::BenchCase&);
const std::vector<std::pair<std::string, Measured>>& section_table() {
  static const std::vector<std::pair<std::string, Measured>> table = {
      {"kernels", bench::kernels_section}, {"radiosity", bench::radiosity_section},
      {"threads", bench::threads_section}, {"methods", bench::methods_section},
      {"cells", bench::cells_section},     {"balance", bench::balance_section}};
  return table;
}

/// The Cornell box, of the project's folder or of the installation.
Expected<std::string> default_scene() {
  const std::string name = "scenes/cornell.toml";
  std::error_code ignored;
  if (fs::exists(name, ignored)) return name;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const std::string installed = (program.parent_path().parent_path() / "share/lichthof" / name).string();
  if (fs::exists(installed, ignored)) return installed;
  return Error{ErrorCode::bad_input, "--scene", "there is no " + name + " here, nor " + installed + "; name a scene"};
}

Expected<std::shared_ptr<const Scene>> scene_of(const std::string& path, const io::ReadOptions& read) {
  Expected<io::LoadedScene> loaded = io::read_scene(path, read);
  if (!loaded) return loaded.error();
  for (const Material& material : loaded->scene.materials)
    if (material.emits()) return std::make_shared<const Scene>(std::move(loaded->scene));
  return Error{ErrorCode::bad_input, path, "there is no luminaire: give a material an emission"};
}

Status bench_command(const BenchCommand& options, const Interruption& interruption) {
  log_as_asked(options.talk);
  const Expected<std::string> path = options.scene.empty() ? default_scene() : Expected<std::string>(options.scene);
  if (!path) return path.error();
  const Expected<std::shared_ptr<const Scene>> scene = scene_of(*path, options.read);
  if (!scene) return scene.error();
  const Interruption::Deferral deferral;
  const bench::BenchCase measured(*scene, options.repeat, interruption.asked());
  if (measured.mesh()->elements.empty())
    return Error{ErrorCode::bad_input, *path, "has no face that could be lit: glass and hidden faces hold no light"};

  nlohmann::json document = {
      {"command", "bench"}, {"version", LICHTHOF_VERSION}, {"scene", *path}, {"repeat", options.repeat}};
  std::vector<std::string> lines{*path + ": " + grouped(measured.scene()->surfaces.size()) + " surfaces, " +
                                 grouped(measured.mesh()->elements.size()) + " elements"};
  for (const auto& [name, measure] : section_table()) {
    if (options.section != "all" && options.section != name) continue;
    const Expected<bench::Section> section = measure(measured);
    if (!section) return section.error();
    document[name] = bench::json(*section);
    for (std::string& line : bench::lines(*section)) lines.push_back(std::move(line));
  }
  return print(options.talk, document, lines);
}

}  // namespace

void add_bench(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<BenchCommand>();
  CLI::App& command = *program.add_subcommand("bench", "measure this machine: ratios, beside the goals for them");
  std::vector<std::string> names;
  for (const auto& [name, measure] : section_table()) names.push_back(name);
  names.push_back("all");
  command.add_option("SECTION", options->section, "one of those below (default all)")
      ->check(one_of(names))
      ->option_text(" ");
  command.add_option("--scene", options->scene, "a scene (.obj, .toml) (default scenes/cornell.toml)")
      ->option_text("SCENE");
  command.add_option("--repeat", options->repeat, "rounds of each measurement, the best counts (default 3)")
      ->check(number_within(1, 1000))
      ->option_text("N");
  add_scene_options(command, options->read);
  add_output_options(command, options->talk);
  command.footer(
      "What is compared is measured in one run, in CPU seconds where the table does not say wall clock.\n"
      "  kernels    form factors per second, each vector width and scalar; filling a bitmap, looking into one\n"
      "  radiosity  rays the radiosity pass gets answered per second : what the ray tracer alone does on such rays\n"
      "  threads    wall clock of both passes with 1 and 2 threads; whether the results agree bit for bit\n"
      "  methods    shadow rays and the hemicube's item buffer: time, and error against path tracing\n"
      "  cells      1 to 8 cells: difference to one cell, shots, bytes per message, compression of bitmaps\n"
      "  balance    idle share of 2 workers of the ray pass; speed-up of 38 in virtual time on measured columns\n"
      "Goals are stated where the project has one; a missed goal does not change the exit status.\n"
      "\nExamples:\n"
      "  lichthof bench\n"
      "  lichthof bench kernels --json\n"
      "  lichthof bench radiosity --scene room.obj --repeat 5");
  command.callback([options, &chosen] {
    chosen = [options](Interruption& interruption) { return bench_command(*options, interruption); };
  });
}

}  // namespace lichthof::apps
