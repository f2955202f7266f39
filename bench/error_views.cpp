#include <algorithm>
#include <cstdio>

#include "bench/error.hpp"
#include "bench/log_plot.hpp"

namespace lichthof::bench {

namespace {

/// The run of ours that wins most against path tracing, and the one with the smallest error; null where there is none.
struct Best {
  const ErrorRun* against_reference = nullptr;
  const ErrorRun* finest = nullptr;
};
Best best_of(const ErrorReport& report) {
  Best best;
  for (const ErrorRun& run : report.runs) {
    if (!(run.ratio > 0)) continue;
    if (!best.against_reference || run.ratio > best.against_reference->ratio) best.against_reference = &run;
    if (!best.finest || run.error < best.finest->error) best.finest = &run;
  }
  return best;
}

struct MethodLook {
  const char* name;
  const char* colour;  // from Okabe and Ito's set, which the colour-blind tell apart too
  Mark mark;
};
/// As tables and plots call a run: the first pass on a refined mesh is no method of its own.
constexpr const char* refined_name = "refined";
std::string name_of(const ErrorRun& run) { return run.is_refined ? refined_name : run.method; }

constexpr MethodLook method_looks[] = {{"two-pass", "#0072b2", Mark::circle},
                                       {"radiosity", "#009e73", Mark::square},
                                       {refined_name, "#56b4e9", Mark::square},
                                       {"hemicube", "#d55e00", Mark::diamond},
                                       {"reference", "#6e5494", Mark::triangle}};
constexpr MethodLook scene_looks[] = {
    {"", "#0072b2", Mark::circle}, {"", "#d55e00", Mark::diamond}, {"", "#009e73", Mark::square}};

/// All resolved runs of a method as marks; a line through those that none of the same method beats.
Curve curve_of(const ErrorReport& report, const MethodLook& look) {
  Curve curve{look.name, look.colour, look.mark, {}, {}};
  std::vector<CostError> costs;
  for (const ErrorRun& run : report.runs)
    if (run.resolved && name_of(run) == look.name) {
      curve.points.push_back({run.cpu_s, run.error});
      costs.push_back({run.cpu_s, run.error});
    }
  for (const std::size_t k : frontier(costs)) curve.line.push_back(curve.points[k]);
  return curve;
}

Panel error_panel(const ErrorReport& report) {
  Panel panel{report.scene, {"CPU time (s)"}, {"RMS error of the irradiance", true}, {}};
  std::vector<CostError> costs;
  for (const ErrorRun& run : report.runs)
    if (run.on_frontier) costs.push_back({run.cpu_s, run.error});
  Curve best{"frontier", "#f2d75c", Mark::none, {}, {}, 9};
  for (const std::size_t k : frontier(costs)) best.line.push_back({costs[k].cpu_s, costs[k].error});
  panel.curves.push_back(std::move(best));
  for (const MethodLook& look : method_looks)
    if (Curve curve = curve_of(report, look); !curve.points.empty()) panel.curves.push_back(std::move(curve));
  return panel;
}

Panel growth_panel(std::span<const ErrorReport> reports) {
  Panel panel{"cost of the first pass, eps 2e-3", {"elements"}, {"CPU time (s)"}, {}, Panel::Key::upper_left};
  for (std::size_t k = 0; k < reports.size(); ++k) {
    char exponent[32];
    std::snprintf(exponent, sizeof exponent, " ~ N^%.2f", reports[k].growth_exponent);
    const MethodLook& look = scene_looks[k % std::size(scene_looks)];
    Curve curve{reports[k].scene + exponent, look.colour, look.mark, {}, {}};
    for (const GrowthRun& run : reports[k].growth)
      curve.points.push_back({static_cast<double>(run.elements), run.cpu_s});
    curve.line = curve.points;
    if (!curve.points.empty()) panel.curves.push_back(std::move(curve));
  }
  return panel;
}

}  // namespace

Section error_section(std::span<const ErrorReport> reports) {
  Section section{"error", {}};
  double growth = 0;
  RefinementGain refinement;
  for (const ErrorReport& report : reports) {
    const std::string key = "scenes/" + report.scene + "/", text = report.scene + ": ";
    section.add(key + "truth_error", text + "standard error of the truth", report.truth_error);
    if (const Best best = best_of(report); best.finest) {
      section.add(key + "smallest_error", text + "smallest error", best.finest->error);
      section.add(key + "ratio_smallest", text + "CPU time, path tracing : ours, at that error", best.finest->ratio);
      section.add(key + "ratio_error", text + "error where ours wins most", best.against_reference->error);
      section.add(key + "ratio", text + "CPU time, path tracing : ours, at that error", best.against_reference->ratio,
                  "", at_least(10));
    }
    if (const std::optional<RefinementGain>& gain = report.refinement) {
      section.add(key + "refinement/error", text + "smallest error of the first pass on uniform and refined meshes",
                  gain->error);
      section.add(key + "refinement/elements", text + "elements, uniform : refined, at that error", gain->elements);
      section.add(key + "refinement/cpu", text + "CPU time, uniform : refined, at that error", gain->cpu);
      if (gain->elements > refinement.elements) refinement = *gain;
    }
    section.add(key + "growth", text + "exponent of CPU time over elements", report.growth_exponent);
    growth = std::max(growth, report.growth_exponent);
  }
  section.add("growth", "the largest of these exponents", growth, "", at_most(1.15));
  if (refinement.elements > 0) {
    section.add("refinement/elements", "elements, uniform : refined, where that is most", refinement.elements, "",
                at_least(3));
    section.add("refinement/cpu", "CPU time, uniform : refined, there", refinement.cpu, "", at_least(2));
  }
  return section;
}

nlohmann::json runs_json(const ErrorReport& report) {
  nlohmann::json runs = nlohmann::json::array(), growth = nlohmann::json::array();
  for (const ErrorRun& run : report.runs) {
    nlohmann::json one = {{"method", run.method},     {"refined", run.is_refined},
                          {"cpu_s", run.cpu_s},       {"error", run.error},
                          {"rays", run.rays},         {"direct_rays", run.direct_rays},
                          {"resolved", run.resolved}, {"on_frontier", run.on_frontier}};
    if (!run.is_reference()) one.update({{"elements", run.elements}, {"eps", run.eps}});
    if (run.ratio > 0) one["ratio"] = run.ratio;
    runs.push_back(std::move(one));
  }
  for (const GrowthRun& run : report.growth)
    growth.push_back({{"elements", run.elements}, {"shots", run.shots}, {"cpu_s", run.cpu_s}});
  return {{"points", report.truth.points.size()},
          {"truth_paths", report.truth.paths},
          {"runs", std::move(runs)},
          {"growth_runs", std::move(growth)}};
}

std::vector<std::string> table(const ErrorReport& report) {
  char line[300];
  std::vector<std::string> lines;
  std::snprintf(
      line, sizeof line,
      "%s: %zu points%s; + is on the frontier, ratio = CPU time of path tracing to that error : this, refined = "
      "radiosity on a mesh that is finer where the light asks for it",
      report.scene.c_str(), report.truth.points.size(),
      report.truth.paths > 0 ? (", truth by " + std::to_string(report.truth.paths) + " paths each").c_str() : "");
  lines.emplace_back(line);
  lines.emplace_back("  method     elements       eps    rays  direct     CPU s     error     ratio");
  for (const ErrorRun& run : report.runs) {
    char mesh[40] = "       -         -", ratio[24] = "-";
    if (!run.is_reference()) std::snprintf(mesh, sizeof mesh, "%8u  %8.2g", run.elements, run.eps);
    if (run.ratio > 0) std::snprintf(ratio, sizeof ratio, "%.3g", run.ratio);
    std::snprintf(line, sizeof line, "  %-10s %s  %6u  %6s  %8.3f  %s%6.3f %%  %8s %s", name_of(run).c_str(), mesh,
                  run.rays, run.direct_rays > 0 ? std::to_string(run.direct_rays).c_str() : "-", run.cpu_s,
                  run.resolved ? " " : "<", 100 * run.error, ratio, run.on_frontier ? "+" : "");
    lines.emplace_back(line);
  }
  lines.emplace_back("  growth     elements     shots     CPU s");
  for (const GrowthRun& run : report.growth) {
    std::snprintf(line, sizeof line, "             %8llu  %8llu  %8.3f", static_cast<unsigned long long>(run.elements),
                  static_cast<unsigned long long>(run.shots), run.cpu_s);
    lines.emplace_back(line);
  }
  return lines;
}

std::string plot(std::span<const ErrorReport> reports, const std::string& caption) {
  std::vector<Panel> panels;
  // A coarse truth from a file may leave no error of a scene resolved.
  for (const ErrorReport& report : reports)
    if (Panel panel = error_panel(report); panel.curves.size() > 1) panels.push_back(std::move(panel));
  panels.push_back(growth_panel(reports));
  return svg(panels, caption);
}

}  // namespace lichthof::bench
