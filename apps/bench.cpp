/// `lichthof bench`: figures of this machine, as ratios measured in one run, beside the project's goals for them.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/progress.hpp"
#include "apps/common/report.hpp"
#include "bench/error.hpp"
#include "bench/sections.hpp"
#include "core/base/check.hpp"
#include "core/scene/joined_facets.hpp"
#include "io/atomic_file.hpp"
#include "io/points_file.hpp"
#include "io/scene_reader.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

namespace fs = std::filesystem;

constexpr const char* error_name = "error";

struct BenchCommand {
  std::string section = "all";
  std::string scene;
  unsigned repeat = 3;
  // Of section `error` alone:
  std::string plot, reference;
  std::optional<std::string> elements, growth;
  std::optional<std::uint32_t> points, paths;
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

/// A scene that comes with the program, in the project's folder or in the installation.
Expected<std::string> built_in(const std::string& file) {
  const std::string name = "scenes/" + file;
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
  join_facets(loaded->scene);
  for (const Material& material : loaded->scene.materials)
    if (material.emits()) return std::make_shared<const Scene>(std::move(loaded->scene));
  return Error{ErrorCode::bad_input, path, "there is no luminaire: give a material an emission"};
}

/// @error bad_input also when there is nothing to light
Expected<std::unique_ptr<const bench::BenchCase>> case_of(const std::string& path, const BenchCommand& options,
                                                          const Interruption& interruption) {
  const Expected<std::shared_ptr<const Scene>> scene = scene_of(path, options.read);
  if (!scene) return scene.error();
  auto measured = std::make_unique<const bench::BenchCase>(*scene, options.repeat, interruption.asked());
  if (measured->mesh()->elements.empty())
    return Error{ErrorCode::bad_input, path, "has no face that could be lit: glass and hidden faces hold no light"};
  return std::unique_ptr<const bench::BenchCase>(std::move(measured));
}

nlohmann::json header_of(const BenchCommand& options) {
  return {{"command", "bench"}, {"version", LICHTHOF_VERSION}, {"repeat", options.repeat}};
}

std::string described(const std::string& path, const bench::BenchCase& measured) {
  return path + ": " + grouped(measured.scene()->surfaces.size()) + " surfaces, " +
         grouped(measured.mesh()->elements.size()) + " elements";
}

/// All sections but `error`, or one of them.
Status bench_sections(const BenchCommand& options, const Interruption& interruption) {
  const Expected<std::string> path =
      options.scene.empty() ? built_in("cornell.toml") : Expected<std::string>(options.scene);
  if (!path) return path.error();
  const Interruption::Deferral deferral;
  const Expected<std::unique_ptr<const bench::BenchCase>> measured = case_of(*path, options, interruption);
  if (!measured) return measured.error();
  nlohmann::json document = header_of(options);
  document["scene"] = *path;
  std::vector<std::string> lines{described(*path, **measured)};
  for (const auto& [name, measure] : section_table()) {
    if (options.section != "all" && options.section != name) continue;
    const Expected<bench::Section> section = measure(**measured);
    if (!section) return section.error();
    document[name] = bench::json(*section);
    for (std::string& line : bench::lines(*section)) lines.push_back(std::move(line));
  }
  return print(options.talk, document, lines);
}

// ---- Section error ----------------------------------------------------------------------------------------------------

/// Reads "1500..48000". @returns false: it is something else
bool read_range(const std::string& text, bench::ElementRange& range) {
  const std::size_t dots = text.find("..");
  std::int64_t least = 0, most = 0;
  if (dots == std::string::npos || !io::parse_integer(std::string_view(text).substr(0, dots), least) ||
      !io::parse_integer(std::string_view(text).substr(dots + 2), most))
    return false;
  if (least < 1 || least > most || most > most_elements) return false;
  range = {static_cast<std::uint32_t>(least), static_cast<std::uint32_t>(most)};
  return true;
}

CLI::Validator range_text() {
  return {[](std::string& text) {
            bench::ElementRange range;
            return read_range(text, range) ? std::string()
                                           : io::in_quotes(text) + " is no range FROM..TO of numbers from 1 to " +
                                                 std::to_string(most_elements);
          },
          "", "range"};
}

/// The first option given that belongs to section `error`; empty: none.
std::string error_option(const BenchCommand& options) {
  if (!options.plot.empty()) return "--output";
  if (!options.reference.empty()) return "--reference";
  if (options.elements) return "--elements";
  if (options.growth) return "--growth";
  if (options.points) return "--points";
  if (options.paths) return "--paths";
  return "";
}

bench::ErrorOptions error_options(const BenchCommand& options) {
  bench::ErrorOptions wanted;
  if (options.elements) read_range(*options.elements, wanted.elements);  // checked when the command line was read
  if (options.growth) read_range(*options.growth, wanted.growth);
  wanted.points = options.points.value_or(wanted.points);
  wanted.most_paths = options.paths.value_or(wanted.most_paths);
  return wanted;
}

/// Whether a truth can be read from --reference; else it is written there.
bool reference_exists(const BenchCommand& options) {
  std::error_code ignored;
  return !options.reference.empty() && fs::exists(options.reference, ignored);
}

Status check_error_options(const BenchCommand& options) {
  if (!options.plot.empty())
    if (Status ready = output_ready(options.plot, {".svg"}, {options.scene, options.reference}); !ready) return ready;
  if (options.reference.empty()) return Done{};
  if (options.scene.empty())
    return Error{ErrorCode::bad_input, "--reference", "belongs to one scene; name it with --scene"};
  if (!reference_exists(options)) return output_ready(options.reference, {}, {options.scene, options.plot});
  for (const auto& [name, given] :
       {std::pair{"--points", options.points.has_value()}, {"--paths", options.paths.has_value()}})
    if (given) return Error{ErrorCode::bad_input, name, "is settled by " + options.reference + ", which exists"};
  return Done{};
}

Expected<std::optional<bench::Truth>> known_truth(const BenchCommand& options, const Scene& scene) {
  if (!reference_exists(options)) return std::optional<bench::Truth>();
  Expected<io::PointEstimates> known = io::read_estimates(options.reference, scene.file_frame);
  if (!known) return known.error();
  bench::Truth truth{std::move(known->points), std::move(known->irradiance), 0};
  double largest = 0;
  for (const Estimate& estimate : truth.irradiance) largest = std::max(largest, max_channel(estimate.mean));
  if (!(largest > 0))
    return Error{ErrorCode::bad_input, options.reference, "all irradiance is 0: nothing to compare with"};
  return std::optional<bench::Truth>(std::move(truth));
}

Status bench_error(const BenchCommand& options, const Interruption& interruption) {
  if (Status checked = check_error_options(options); !checked) return checked;
  std::vector<std::string> paths;
  if (!options.scene.empty()) paths.push_back(options.scene);
  for (const char* file : {"cornell.toml", "office_floor.toml", "cellar.toml"}) {
    if (!options.scene.empty()) break;
    const Expected<std::string> path = built_in(file);
    if (!path) return path.error();
    paths.push_back(*path);
  }
  const Interruption::Deferral deferral;
  std::vector<bench::ErrorReport> reports;
  std::vector<std::string> lines;
  nlohmann::json scenes = nlohmann::json::object();
  for (const std::string& path : paths) {
    const Expected<std::unique_ptr<const bench::BenchCase>> measured = case_of(path, options, interruption);
    if (!measured) return measured.error();
    Expected<std::optional<bench::Truth>> known = known_truth(options, *(*measured)->scene());
    if (!known) return known.error();
    const std::string name = io::printable(fs::path(path).stem().string());
    ProgressLine line(!options.talk.quiet);
    Expected<bench::ErrorReport> report =
        bench::error_report(**measured, name, error_options(options), std::move(*known),
                            [&line](const std::string& what, double share) { line.show(what, share); });
    if (!report) return report.error();
    if (!options.reference.empty() && report->truth.paths > 0)
      if (Status kept = io::write_estimates(options.reference, {report->truth.points, report->truth.irradiance},
                                            (*measured)->scene()->file_frame);
          !kept)
        return kept;
    for (std::string& row : bench::table(*report)) lines.push_back(std::move(row));
    scenes[name] = bench::runs_json(*report);
    scenes[name]["file"] = path;
    reports.push_back(std::move(*report));
  }
  if (!options.plot.empty()) {
    const std::string caption =
        "lichthof " LICHTHOF_VERSION
        " bench error: CPU time of one thread; errors at random points of the surfaces, against path tracing";
    if (Status written = io::write_file(options.plot, bench::plot(reports, caption)); !written) return written;
  }
  const bench::Section section = bench::error_section(reports);
  nlohmann::json document = header_of(options);
  document[error_name] = bench::json(section);
  document[error_name].merge_patch({{"scenes", std::move(scenes)}});
  for (std::string& row : bench::lines(section)) lines.push_back(std::move(row));
  return print(options.talk, document, lines);
}

Status bench_command(const BenchCommand& options, const Interruption& interruption) {
  log_as_asked(options.talk);
  if (options.section == error_name) return bench_error(options, interruption);
  if (const std::string option = error_option(options); !option.empty())
    return Error{ErrorCode::bad_input, option, "belongs to lichthof bench error"};
  return bench_sections(options, interruption);
}

void add_error_options(CLI::App& command, BenchCommand& options) {
  const bench::ErrorOptions usual;
  const auto add = [&](const std::string& name, auto& value, const std::string& text, const std::string& placeholder) {
    return command.add_option(name, value, text)->option_text(placeholder)->group("Section error");
  };
  const auto range = [](const bench::ElementRange& r) {
    return std::to_string(r.least) + ".." + std::to_string(r.most);
  };
  add("-o,--output", options.plot, "error against CPU time as a plot", "PLOT.svg");
  add("--reference", options.reference, "true irradiance at points, CSV: read when it exists, else written",
      "FILE.csv");
  add("--elements", options.elements, "meshes, each twice the one before (default " + range(usual.elements) + ")",
      "FROM..TO")
      ->check(range_text());
  add("--growth", options.growth,
      "meshes for the growth of cost, each four times the one before on the same patches (default " +
          range(usual.growth) + ")",
      "FROM..TO")
      ->check(range_text());
  add("--points", options.points, "random surface points (default " + std::to_string(usual.points) + ")", "N")
      ->check(number_within(1, 20000));
  add("--paths", options.paths, "most paths per point for the truth (default " + std::to_string(usual.most_paths) + ")",
      "N")
      ->check(number_within(2, 1e9));
}

}  // namespace

void add_bench(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<BenchCommand>();
  CLI::App& command = *program.add_subcommand("bench", "measure this machine: ratios, beside the goals for them");
  std::vector<std::string> names;
  for (const auto& [name, measure] : section_table()) names.push_back(name);
  names.push_back(error_name);
  names.push_back("all");
  command.add_option("SECTION", options->section, "one of those below (default all)")
      ->check(one_of(names))
      ->option_text(" ");
  command
      .add_option("--scene", options->scene,
                  "a scene (.obj, .toml) (default scenes/cornell.toml; error takes scenes/office_floor.toml and "
                  "cellar.toml too)")
      ->option_text("SCENE");
  command.add_option("--repeat", options->repeat, "rounds of each measurement, the best counts (default 3)")
      ->check(number_within(1, 1000))
      ->option_text("N");
  add_error_options(command, *options);
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
      "  error      error against CPU time of all methods over meshes and rays; growth of cost (minutes; not in all)\n"
      "Goals are stated where the project has one; a missed goal does not change the exit status.\n"
      "\nExamples:\n"
      "  lichthof bench\n"
      "  lichthof bench kernels --json\n"
      "  lichthof bench radiosity --scene room.obj --repeat 5\n"
      "  lichthof bench error -o error.svg\n"
      "  lichthof bench error --scene room.obj --reference room_truth.csv --elements 3000..12000");
  command.callback([options, &chosen] {
    chosen = [options](Interruption& interruption) { return bench_command(*options, interruption); };
  });
}

}  // namespace lichthof::apps
