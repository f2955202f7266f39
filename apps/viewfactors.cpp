/// `lichthof viewfactors`: the matrix of view factors between the surfaces of a scene.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/commands.hpp"
#include "apps/common/files.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/progress.hpp"
#include "apps/common/report.hpp"
#include "core/light/view_factors.hpp"
#include "io/scene_reader.hpp"
#include "io/view_factor_file.hpp"

namespace lichthof::apps {

namespace {

/// Pairs grow with the square: this many already keep a processor busy for days where much stands between.
constexpr std::size_t most_sides = 8192;

struct ViewFactorCommand {
  std::string input, output;
  io::ReadOptions read;
  std::string by = "face", sides = "front";
  double tolerance = 1e-6;
  unsigned threads = 0;
  OutputOptions talk;
};

/// The rows of the matrix and what counts to them.
struct Rows {
  std::vector<ViewSide> sides;
  std::vector<std::string> names;
};

Rows rows_of(const Scene& scene, const ViewFactorCommand& options) {
  const bool by_material = options.by == "material";
  Rows rows;
  std::map<std::pair<std::uint32_t, bool>, std::uint32_t> number;
  for (std::uint32_t i = 0; i < scene.surfaces.size(); ++i) {
    const Surface& surface = scene.surfaces[i];
    const std::string& material = scene.material_of(surface).name;
    for (const bool back : {false, true}) {
      if (back && options.sides != "both") continue;
      const auto next = static_cast<std::uint32_t>(rows.names.size());
      const auto [row, added] = number.try_emplace({by_material ? surface.material : surface.source_face, back}, next);
      if (added)
        rows.names.push_back((by_material ? material : std::to_string(surface.source_face) + ":" + material) +
                             (back ? ":back" : ""));
      rows.sides.push_back({i, back, row->second});
    }
  }
  return rows;
}

void tell(const io::ImportReport& report) {
  for (const std::string& line : report.text()) {
    constexpr std::string_view warning = "warning: ";
    if (line.starts_with(warning))
      spdlog::warn("{}", line.substr(warning.size()));
    else
      spdlog::info("{}", line);
  }
}

/// What the rows' sums tell: of a closed scene each is 1.
struct RowSums {
  double least = 1e300, most = 0;
  std::size_t furthest = 0;  ///< row whose sum is furthest from 1
  double deviation = -1;
};

RowSums row_sums(const ViewFactors& factors) {
  RowSums sums;
  for (std::size_t i = 0; i < factors.count; ++i) {
    const double sum = factors.row_sum(i);
    sums.least = std::min(sums.least, sum), sums.most = std::max(sums.most, sum);
    if (std::abs(sum - 1) > sums.deviation) sums.deviation = std::abs(sum - 1), sums.furthest = i;
  }
  return sums;
}

double largest_error(const ViewFactors& factors) {
  double largest = 0;
  for (std::size_t i = 0; i < factors.count; ++i)
    for (std::size_t j = 0; j < factors.count; ++j) largest = std::max(largest, factors.error(i, j));
  return largest;
}

std::string shown(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

nlohmann::json document(const ViewFactorCommand& options, const ViewFactors& factors, const Rows& rows,
                        const io::ImportReport& report) {
  const RowSums sums = row_sums(factors);
  return {{"command", "viewfactors"},
          {"version", LICHTHOF_VERSION},
          {"input", options.input},
          {"output", options.output.empty() ? nlohmann::json(nullptr) : nlohmann::json(options.output)},
          {"by", options.by},
          {"sides", options.sides},
          {"tolerance", options.tolerance},
          {"surfaces", factors.count},
          {"pairs",
           {{"facing", factors.pairs_facing},
            {"obstructed", factors.pairs_obstructed},
            {"inexact", factors.pairs_inexact}}},
          {"points", factors.points},
          {"largest_error_estimate", largest_error(factors)},
          {"row_sums",
           {{"least", sums.least},
            {"most", sums.most},
            {"largest_deviation", sums.deviation},
            {"at", rows.names[sums.furthest]}}},
          {"reciprocity",
           {{"pairs", factors.pairs_both_ways},
            {"disagreeing", factors.pairs_disagreeing},
            {"largest_defect", factors.reciprocity_defect},
            {"largest_defect_m2", factors.reciprocity_defect_m2},
            {"between", {rows.names[factors.defect_row], rows.names[factors.defect_column]}}}},
          {"import", report.json()},
          {"peak_memory_bytes", peak_memory_bytes()}};
}

std::vector<std::string> summary(const ViewFactorCommand& options, const ViewFactors& factors, const Rows& rows,
                                 double seconds) {
  const RowSums sums = row_sums(factors);
  std::vector<std::string> lines{(options.output.empty() ? "" : options.output + ": ") + grouped(factors.count) +
                                 (options.by == "face" ? " faces" : " materials")};
  lines.push_back(grouped(factors.pairs_facing) + " pairs of surfaces face each other, " +
                  grouped(factors.pairs_obstructed) + " with something between");
  lines.push_back("row sums: " + shown("%.9f", sums.least) + shown(" to %.9f; ", sums.most) +
                  shown("furthest from 1 by %.1e", sums.deviation) + " at " + rows.names[sums.furthest]);
  if (factors.pairs_both_ways > 0)
    lines.push_back("reciprocity: |A_i F_ij - A_j F_ji| at most" + shown(" %.1e m²,", factors.reciprocity_defect_m2) +
                    shown(" %.1e of the smaller area, in ", factors.reciprocity_defect) +
                    grouped(factors.pairs_both_ways) + " pairs computed both ways; " +
                    grouped(factors.pairs_disagreeing) + " disagree beyond their error estimates");
  lines.push_back(
      "error estimate of a factor: at most" + shown(" %.1e", largest_error(factors)) +
      (factors.pairs_inexact > 0 ? "; " + grouped(factors.pairs_inexact) + " pairs missed the tolerance" : ""));
  lines.push_back(shown("%.2f s", seconds));
  return lines;
}

Status view_factors_of(const ViewFactorCommand& options) {
  const Stopwatch total;
  log_as_asked(options.talk);
  if (!options.output.empty())
    if (Status ready = output_ready(options.output, {".csv", ".json"}, {options.input}); !ready) return ready;
  const Expected<io::LoadedScene> loaded = io::read_scene(options.input, options.read);
  if (!loaded) return loaded.error();
  tell(loaded->report);
  const double load_s = total.seconds();
  const Rows rows = rows_of(loaded->scene, options);
  if (rows.sides.size() > most_sides)
    return Error{
        ErrorCode::bad_input, options.input,
        grouped(rows.sides.size()) + " sides of surfaces; the matrix is made for at most " + grouped(most_sides)};

  const Parallel parallel(threads_to_use(options.threads));
  ViewFactors factors;
  {
    ProgressLine line(!options.talk.quiet);
    const auto progress = [&line](double share) { line.show("view factors", share); };
    factors = view_factors(loaded->scene, rows.sides, static_cast<std::uint32_t>(rows.names.size()),
                           {.tolerance = options.tolerance}, parallel, progress);
  }
  const Interruption::Deferral deferral;
  if (!options.output.empty())
    if (Status written = io::write_view_factors(options.output, factors, rows.names); !written) return written;
  nlohmann::json report = document(options, factors, rows, loaded->report);
  report["threads"] = parallel.threads();
  report["seconds"] = {{"load", load_s}, {"total", total.seconds()}};
  return print(options.talk, report, summary(options, factors, rows, total.seconds()));
}

}  // namespace

void add_viewfactors(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ViewFactorCommand>();
  CLI::App& command =
      *program.add_subcommand("viewfactors", "compute the view factors between surfaces, with obstruction");
  command.add_option("SCENE", options->input, "a scene (.obj, .toml)")->required()->option_text(" ");
  command.add_option("-o,--output", options->output, "the matrix: .csv, or .json with error estimates")
      ->option_text("MATRIX");
  command.add_option("--by", options->by, "rows: face, the faces of the file, or material (default face)")
      ->check(one_of({"face", "material"}))
      ->option_text("WHAT");
  command
      .add_option("--sides", options->sides,
                  "which sides of faces have rows: front (counter-clockwise corners) or both (default front)")
      ->check(one_of({"front", "both"}))
      ->option_text("SIDES");
  command
      .add_option("--tolerance", options->tolerance,
                  "allowed error of a factor between two surfaces, seen from the smaller one (default 1e-6)")
      ->check(number_within(1e-9, 0.1))
      ->option_text("ERROR");
  add_threads_option(command, options->threads);
  add_scene_options(command, options->read);
  add_output_options(command, options->talk);
  command.footer(
      "F_ij, in row i and column j, is the share of what leaves surface i diffusely that reaches j directly. Every "
      "face\n"
      "obstructs, with both sides, mirrors and glass too. Pairs with nothing between are exact to ten digits; others "
      "stop\n"
      "at the tolerance. Every pair is computed once, so A_i F_ij = A_j F_ji holds exactly in the matrix; a sample of "
      "pairs\n"
      "is computed once more the other way round, and the largest difference reported. In a closed scene rows sum to "
      "1.\n"
      "A row is named by its face's number in the file, from 1, and its material.\n"
      "\nExamples:\n"
      "  lichthof viewfactors room.obj -o factors.csv\n"
      "  lichthof viewfactors room.toml -o factors.json --by material --tolerance 1e-4\n"
      "  lichthof viewfactors baffle.obj --sides both --json");
  command.callback([options, &chosen] { chosen = [options](Interruption&) { return view_factors_of(*options); }; });
}

}  // namespace lichthof::apps
