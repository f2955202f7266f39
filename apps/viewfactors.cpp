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
#include "io/text.hpp"
#include "io/view_factor_file.hpp"

namespace lichthof::apps {

namespace {

/// Pairs grow with the square: this many already keep a processor busy for days where much stands between.
constexpr std::size_t most_sides = 8192;

struct ViewFactorCommand {
  std::string input, output;
  io::ReadOptions read;
  std::string by = "face", sides = "front";
  std::vector<std::string> rows, obstruct_only;  ///< patterns of names
  double tolerance = 1e-6;
  unsigned threads = 0;
  OutputOptions talk;
};

/// The rows of the matrix and what counts to them.
struct Rows {
  std::vector<ViewSide> sides;
  std::vector<std::string> names;
  std::vector<char> asked;         ///< by --rows; empty: all
  std::vector<double> emittances;  ///< 1 - reflectance, of each row's first surface
};

/// What a surface is called.
struct Names {
  std::string face, material, group;
  bool one_is_of(const std::vector<std::string>& patterns) const {
    return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
      return io::is_of_pattern(face, pattern) || io::is_of_pattern(material, pattern) ||
             (!group.empty() && io::is_of_pattern(group, pattern));
    });
  }
};

/// @param face  its number, from 1
Names names_of(const io::LoadedScene& loaded, std::uint32_t face, const Surface& surface) {
  Names names{"", loaded.scene.material_of(surface).name, ""};
  names.face = std::to_string(face) + ":" + names.material;
  if (const std::uint32_t group = loaded.origins[face - 1].group; group != io::FaceList::Origin::none)
    names.group = loaded.groups[group];
  return names;
}

Rows rows_of(const io::LoadedScene& loaded, const ViewFactorCommand& options) {
  const Scene& scene = loaded.scene;
  Rows rows;
  std::map<std::pair<std::string, bool>, std::uint32_t> number;
  for (std::uint32_t i = 0; i < scene.surfaces.size(); ++i) {
    const Surface& surface = scene.surfaces[i];
    const io::FaceList::Origin& origin = loaded.origins[surface.source_face - 1];
    Names names = names_of(loaded, surface.source_face, surface);
    if (origin.only_obstructs || names.one_is_of(options.obstruct_only)) continue;
    if (origin.counts_to != io::FaceList::Origin::none) {
      const auto whole = std::find_if(scene.surfaces.begin(), scene.surfaces.end(),
                                      [&](const Surface& other) { return other.source_face == origin.counts_to + 1; });
      if (whole != scene.surfaces.end()) names = names_of(loaded, origin.counts_to + 1, *whole);
    }
    const std::string name = options.by == "material" ? names.material
                             : options.by == "face"   ? names.face
                             : names.group.empty()    ? "default"
                                                      : names.group;
    for (const bool back : {false, true}) {
      if (back && options.sides != "both") continue;
      const auto [row, added] = number.try_emplace({name, back}, static_cast<std::uint32_t>(rows.names.size()));
      if (added) {
        rows.names.push_back(name + (back ? ":back" : ""));
        const Rgb reflectance = scene.material_of(surface).reflectance;
        rows.emittances.push_back(1 - (reflectance.x + reflectance.y + reflectance.z) / 3);
        if (!options.rows.empty()) rows.asked.push_back(0);
      }
      if (!options.rows.empty() &&
          (names.one_is_of(options.rows) || Names{rows.names[row->second], "", ""}.one_is_of(options.rows)))
        rows.asked[row->second] = 1;
      rows.sides.push_back({i, back, row->second});
    }
  }
  return rows;
}

/// Whether there is a matrix to compute, and it isn't too large a one.
Status rows_fit(const Rows& rows, const ViewFactorCommand& options) {
  if (rows.sides.empty())
    return Error{ErrorCode::bad_input, options.input, "no surface is left that does more than obstruct"};
  if (!rows.asked.empty() && std::find(rows.asked.begin(), rows.asked.end(), 1) == rows.asked.end())
    return Error{ErrorCode::bad_input, "--rows",
                 "no row has a name of that pattern, nor a face, material or group in it"};
  if (rows.sides.size() > most_sides)
    return Error{
        ErrorCode::bad_input, options.input,
        grouped(rows.sides.size()) + " sides of surfaces; the matrix is made for at most " + grouped(most_sides)};
  return Done{};
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

RowSums row_sums(const ViewFactors& factors, const Rows& rows) {
  RowSums sums;
  for (std::size_t i = 0; i < factors.count; ++i) {
    const double sum = factors.row_sum(i);
    if (std::isnan(sum) || (!rows.asked.empty() && !rows.asked[i])) continue;
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
  const RowSums sums = row_sums(factors, rows);
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
            {"inexact", factors.pairs_inexact},
            {"missing", factors.pairs_missing}}},
          {"complete", factors.pairs_missing == 0},
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
  const RowSums sums = row_sums(factors, rows);
  std::vector<std::string> lines{(options.output.empty() ? "" : options.output + ": ") + grouped(factors.count) +
                                 (options.by == "face" ? " faces" : " " + options.by + "s")};
  lines.push_back(grouped(factors.pairs_facing) + " pairs of surfaces face each other, " +
                  grouped(factors.pairs_obstructed) + " with something between");
  lines.push_back("row sums: " + shown("%.9f", sums.least) + shown(" to %.9f; ", sums.most) +
                  shown("furthest from 1 by %.1e", sums.deviation) + " at " + rows.names[sums.furthest]);
  if (factors.pairs_both_ways > 0)
    lines.push_back("reciprocity: |A_i F_ij - A_j F_ji| at most" + shown(" %.1e m²,", factors.reciprocity_defect_m2) +
                    shown(" %.1e of the smaller area, in ", factors.reciprocity_defect) +
                    grouped(factors.pairs_both_ways) + " pairs computed both ways; " +
                    grouped(factors.pairs_disagreeing) + " disagree beyond their error estimates");
  lines.push_back("error estimate of a factor: at most" + shown(" %.1e", largest_error(factors)));
  lines.push_back(shown("%.2f s", seconds));
  return lines;
}

Status written(const ViewFactorCommand& options, const ViewFactors& factors, const Rows& rows) {
  for (const std::string& fault : io::faults(factors, options.tolerance, rows.names)) spdlog::warn("{}", fault);
  if (options.output.empty()) return Done{};
  io::ViewFactorRecord record{options.tolerance, {}, rows.emittances};
  for (std::uint32_t i = 0; i < rows.asked.size(); ++i)
    if (rows.asked[i]) record.rows.push_back(i);
  return io::write_view_factors(options.output, factors, rows.names, record);
}

Status view_factors_of(const ViewFactorCommand& options, const Interruption& interruption) {
  const Stopwatch total;
  log_as_asked(options.talk);
  if (!options.output.empty())
    if (Status ready = output_ready(options.output, {".vf", ".csv", ".json"}, {options.input}); !ready) return ready;
  if (!options.rows.empty() && ending_of(options.output) == ".vf")
    return Error{ErrorCode::bad_input, "--rows",
                 "View3D's files have all rows; a name that ends in .csv or .json was expected"};
  io::ReadOptions read = options.read;
  read.keep_backs = true;
  const Expected<io::LoadedScene> loaded = io::read_scene(options.input, read);
  if (!loaded) return loaded.error();
  tell(loaded->report);
  const double load_s = total.seconds();
  const Rows rows = rows_of(*loaded, options);
  if (Status fit = rows_fit(rows, options); !fit) return fit;

  const Parallel parallel(threads_to_use(options.threads));
  const Interruption::Deferral deferral;
  ViewFactors factors;
  {
    ProgressLine line(!options.talk.quiet);
    const auto progress = [&line](double share) { line.show("view factors", share); };
    ViewFactorOptions wish;
    wish.tolerance = options.tolerance;
    wish.rows = rows.asked;
    wish.stop = &interruption.asked();
    factors = view_factors(loaded->scene, rows.sides, static_cast<std::uint32_t>(rows.names.size()), wish, parallel,
                           progress);
  }
  if (Status kept = written(options, factors, rows); !kept) return kept;
  if (factors.pairs_missing > 0)
    return Error{ErrorCode::interrupted, "",
                 "interrupted" + (options.output.empty() ? "" : "; what was reached is kept in " + options.output)};
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
  command.add_option("SCENE", options->input, "a scene (.obj, .toml, View3D's .vs3)")->required()->option_text(" ");
  command
      .add_option("-o,--output", options->output,
                  "the matrix: .csv, .json with error estimates, or .vf as View3D writes it")
      ->option_text("MATRIX");
  command
      .add_option("--by", options->by,
                  "rows: face, the faces of the file, material, or group, OBJ's o and g (default face)")
      ->check(one_of({"face", "material", "group"}))
      ->option_text("WHAT");
  command
      .add_option("--sides", options->sides,
                  "which sides of faces have rows: front (counter-clockwise corners) or both (default front)")
      ->check(one_of({"front", "both"}))
      ->option_text("SIDES");
  const auto patterns = [&command](const char* name, std::vector<std::string>& values, const char* help) {
    command.add_option(name, values, help)->allow_extra_args(false)->option_text("PATTERN ...");
  };
  patterns("--rows", options->rows,
           "only rows with such a name, face, material or group (* and ? stand for others); repeatable");
  patterns("--obstruct-only", options->obstruct_only,
           "faces, materials or groups of such a name only stand in the way and have no rows; repeatable");
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
      "A row is named by its face's number in the file, from 1, and its material. Two faces back to back are two "
      "rows.\n"
      "A pair whose error is above the tolerance is warned of and named in the file. When interrupted, what was "
      "reached is\n"
      "written and marked as incomplete; the exit status is 1.\n"
      "Limits: 8 192 sides of surfaces. 400 faces with much between take some 30 s of one processor at 1e-4, twice as\n"
      "many four times that. Slivers are right down to widths of 1e-9 of their length; below 1e-10 they are left out,\n"
      "with a warning.\n"
      "\nExamples:\n"
      "  lichthof viewfactors room.obj -o factors.csv\n"
      "  lichthof viewfactors room.toml -o factors.json --by material --tolerance 1e-4\n"
      "  lichthof viewfactors zone.vs3 -o zone.vf\n"
      "  lichthof viewfactors house.obj --by group --rows 'window_*' --obstruct-only 'tree*' -o windows.csv\n"
      "  lichthof viewfactors baffle.obj --sides both --json");
  command.callback(
      [options, &chosen] { chosen = [options](Interruption& i) { return view_factors_of(*options, i); }; });
}

}  // namespace lichthof::apps
