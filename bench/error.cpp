#include "bench/error.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "bench/measure.hpp"
#include "core/light/stopping.hpp"
#include "core/tracing/probe.hpp"

namespace lichthof::bench {

namespace {

constexpr std::uint64_t points_seed = 41, runs_seed = 42, truth_seed = 43;  // independent of each other
constexpr std::uint32_t first_paths = 256;  // of the truth; doubled while that is too few
constexpr std::uint32_t least_paths = 2;    // that have a standard error
constexpr std::uint32_t path_counts[] = {4, 16, 64, 256, 1024};
/// Rays of the final gather and to luminaires: as few as make a picture, what `probe` takes, and more.
constexpr std::uint32_t ray_counts[][2] = {{0, 64}, {0, 512}, {192, 512}, {768, 2048}};
constexpr double kept_deviations[] = {0.3, 0.1};                       // of refined meshes
constexpr std::uint32_t hemicube_gather = 192, hemicube_direct = 512;  // what `probe` takes
// The item buffer is some 20 times as slow as shadow rays, and its error ends falling early.
constexpr std::uint32_t hemicube_share = 4;
// A setting that has taken as long as this is not disturbed by much: it is not repeated.
constexpr double long_run_s = 2;
// A mesh twice as fine as one that took as long is left out where it only serves to compare.
constexpr double dear_s = 2;
constexpr int most_finer = 2;
// The truth is known to half the smallest error: its part is then a fifth of the squares that are measured.
constexpr double finer_than_errors = 2;

/// Finer meshes deserve a later end: the error of the mesh falls with the size of an element, and so does eps.
double eps_of(const BenchCase& scene, std::uint32_t elements) {
  const double usual = default_eps(*scene.scene(), *scene.mesh(), TransferMethod::rays);
  return usual * std::sqrt(static_cast<double>(MeshOptions{}.target_elements) / elements);
}

/// What is made of a first pass at the points.
struct Reading {
  const char* method;
  std::uint32_t gather_rays, direct_rays;  ///< direct 0: the first pass alone
};

constexpr Reading as_it_is{"radiosity", 0, 0};

std::vector<Rgb> read_at(const Solution& solution, const std::vector<SensorPoint>& points, const Reading& reading) {
  const auto lit = std::make_shared<const LitScene>(solution);
  if (reading.direct_rays == 0) return first_pass_irradiance(*lit, points);
  std::uint64_t rays = 0;
  return sensor_irradiance(lit, points, probe_options(reading.gather_rays, reading.direct_rays), Parallel(1), rays);
}

class Sweep {
 public:
  Sweep(const BenchCase& scene, const std::string& name, const ErrorOptions& options, const ShowProgress& show,
        ErrorReport& report)
      : scene_(scene), name_(name), show_(show), options_(options), report_(report),
        to_do_(most_finer + (2 + std::size(kept_deviations)) * options.elements.doubled().size() +
               options.growth.fineness().size() + std::size(path_counts)) {}

  Status all() {
    std::vector<Reading> readings{as_it_is};
    for (const auto& [gather, direct] : ray_counts) readings.push_back({"two-pass", gather, direct});
    for (const std::uint32_t elements : options_.elements.doubled())
      if (Status run = first_pass(TransferMethod::rays, elements, readings); !run) return run;
    // Refined meshes reach errors that only far finer uniform ones do.
    std::uint32_t finer = 2 * options_.elements.doubled().back();
    double last_s = report_.runs[report_.runs.size() - readings.size()].cpu_s;
    for (int k = 0; k < most_finer && last_s < dear_s; ++k, finer *= 2, last_s = report_.runs.back().cpu_s)
      if (Status run = first_pass(TransferMethod::rays, finer, {as_it_is}); !run) return run;
    for (const std::uint32_t elements : options_.elements.doubled())
      for (const double keep : kept_deviations)
        if (Status run = refined(elements, keep); !run) return run;
    for (const std::uint32_t elements : options_.elements.doubled()) {
      if (elements > std::max(options_.elements.most / hemicube_share, options_.elements.least)) break;
      if (Status run = first_pass(TransferMethod::hemicube, elements, {{"hemicube", hemicube_gather, hemicube_direct}});
          !run)
        return run;
    }
    for (const std::uint32_t paths : path_counts)
      if (Status run = path_tracing(paths); !run) return run;
    for (const std::uint32_t fineness : options_.growth.fineness())
      if (Status run = growth(fineness); !run) return run;
    return Done{};
  }

 private:
  void show(const std::string& what) {
    if (show_) show_(name_ + ": " + what, static_cast<double>(done_++) / static_cast<double>(to_do_));
  }
  bool another_round(unsigned round, double spent_s) const {
    return round < scene_.repeat() && (round == 0 || spent_s < long_run_s);
  }

  Status first_pass(TransferMethod transfer, std::uint32_t elements, const std::vector<Reading>& readings) {
    show(std::string(transfer == TransferMethod::rays ? "rays" : "hemicube") + ", " + std::to_string(elements) +
         " elements");
    const double eps = eps_of(scene_, elements);
    return first_pass(eps, false, readings, [&] { return scene_.solve_with(elements, eps, transfer); });
  }

  Status refined(std::uint32_t elements, double keep) {
    show(std::to_string(elements) + " elements, refined");
    const double eps = eps_of(scene_, elements);
    return first_pass(eps, true, {as_it_is}, [&] { return scene_.solve_refined(elements, eps, keep); });
  }

  Status first_pass(double eps, bool is_refined, const std::vector<Reading>& readings,
                    const std::function<Expected<Solved>()>& solve) {
    const std::size_t first = report_.runs.size();
    for (const Reading& reading : readings) {
      ErrorRun run;
      run.method = reading.method, run.is_refined = is_refined, run.eps = eps;
      run.rays = reading.gather_rays, run.direct_rays = reading.direct_rays, run.cpu_s = 1e300;
      report_.runs.push_back(std::move(run));
    }
    double solve_s = 1e300, spent_s = 0;
    std::vector<double> read_s(readings.size(), 1e300);
    for (unsigned round = 0; another_round(round, spent_s); ++round) {
      const Expected<Solved> solved = solve();
      if (!solved) return solved.error();
      solve_s = std::min(solve_s, solved->cpu_s), spent_s += solved->cpu_s;
      for (std::size_t k = 0; k < readings.size(); ++k) {
        ErrorRun& run = report_.runs[first + k];
        const double start = cpu_s();
        run.irradiance = read_at(solved->solution, report_.truth.points, readings[k]);
        const double taken_s = cpu_s() - start;
        read_s[k] = std::min(read_s[k], taken_s), spent_s += taken_s;
        run.elements = static_cast<std::uint32_t>(solved->solution.mesh->elements.size());
        run.cpu_s = solve_s + read_s[k];
        if (scene_.stopped()) return BenchCase::interrupted();
      }
    }
    return Done{};
  }

  Status path_tracing(std::uint32_t paths) {
    show("reference, " + std::to_string(paths) + " paths");
    ErrorRun run;
    run.method = "reference", run.rays = paths, run.cpu_s = 1e300;
    double spent_s = 0;
    for (unsigned round = 0; another_round(round, spent_s); ++round) {
      const double start = cpu_s();
      const PathTracer tracer(std::make_shared<const LitScene>(scene_.scene()));
      const Expected<std::vector<Estimate>> traced =
          path_traced(scene_, tracer, report_.truth.points, paths, runs_seed + paths, Parallel(1));
      if (!traced) return traced.error();
      run.cpu_s = std::min(run.cpu_s, cpu_s() - start), spent_s += cpu_s() - start;
      run.irradiance.clear();
      for (const Estimate& estimate : *traced) run.irradiance.push_back(estimate.mean);
    }
    report_.runs.push_back(std::move(run));
    return Done{};
  }

  Status growth(std::uint32_t fineness) {
    const std::uint32_t elements = options_.growth.least;
    show("growth, " + std::to_string(elements * fineness * fineness) + " elements");
    GrowthRun run;
    run.cpu_s = 1e300;
    double spent_s = 0;
    for (unsigned round = 0; another_round(round, spent_s); ++round) {
      const Expected<Solved> solved = scene_.solve_with(elements, SolveOptions{}.eps, TransferMethod::rays, fineness);
      if (!solved) return solved.error();
      run.elements = solved->solution.mesh->elements.size(), run.shots = solved->solution.counters.shots;
      run.cpu_s = std::min(run.cpu_s, solved->cpu_s), spent_s += solved->cpu_s;
    }
    report_.growth.push_back(run);
    return Done{};
  }

  const BenchCase& scene_;
  const std::string& name_;
  const ShowProgress& show_;
  const ErrorOptions& options_;
  ErrorReport& report_;
  std::size_t done_ = 0, to_do_;
};

/// Path traces the truth, each instalment as long as all before, until it is finer than every run's error.
Status find_truth(const BenchCase& scene, const ErrorOptions& options, const ShowProgress& show, ErrorReport& report) {
  const Parallel parallel(std::max(1u, std::thread::hardware_concurrency()));
  const PathTracer tracer(std::make_shared<const LitScene>(scene.scene()));
  Truth& truth = report.truth;
  const auto smallest_measured = [&] {
    double smallest = 1e300;
    for (const ErrorRun& run : report.runs)
      smallest = std::min(smallest, relative_error(run.irradiance, truth.irradiance));
    return smallest;
  };
  // measured² = error² + truth², and the error should be `finer_than_errors` times the truth's.
  const double enough = std::hypot(finer_than_errors, 1.0);
  while (truth.paths < options.most_paths &&
         (truth.paths == 0 || smallest_measured() < enough * standard_error(truth.irradiance))) {
    const std::uint32_t more =
        std::max(least_paths, std::min(std::max(truth.paths, first_paths), options.most_paths - truth.paths));
    const std::string what = report.scene + ": truth, " + std::to_string(truth.paths + more) + " paths";
    const Expected<std::vector<Estimate>> traced =
        path_traced(scene, tracer, truth.points, more, truth_seed + truth.paths, parallel, [&](double share) {
          if (show) show(what, share);
        });
    if (!traced) return traced.error();
    if (truth.paths == 0) truth.irradiance.resize(traced->size());
    for (std::size_t i = 0; i < traced->size(); ++i)
      truth.irradiance[i] = merged(truth.irradiance[i], truth.paths, (*traced)[i], more);
    truth.paths += more;
  }
  return Done{};
}

std::vector<CostError> costs_of(const std::vector<ErrorRun>& runs, const std::vector<std::size_t>& chosen) {
  std::vector<CostError> costs;
  for (const std::size_t k : chosen) costs.push_back({runs[k].cpu_s, runs[k].error});
  return costs;
}

/// What an error costs by the best of some runs, between two of them in powers. @pre an error that they span
double cost_at(double error, const std::vector<CostError>& runs) {
  const std::vector<std::size_t> best = frontier(runs);
  std::size_t k = 1;
  while (k + 1 < best.size() && runs[best[k]].error > error) ++k;
  if (best.size() == 1 || runs[best[0]].error <= error) return runs[best[0]].cpu_s;
  const CostError &coarse = runs[best[k - 1]], &fine = runs[best[k]];
  const double way = std::log(coarse.error / error) / std::log(coarse.error / fine.error);
  return coarse.cpu_s * std::pow(fine.cpu_s / coarse.cpu_s, way);
}

std::optional<RefinementGain> gain_of_refinement(const std::vector<ErrorRun>& runs) {
  std::vector<CostError> elements[2], cpu[2];  // uniform, refined
  double smallest[2] = {1e300, 1e300}, largest[2] = {0, 0};
  for (const ErrorRun& run : runs) {
    if (!run.resolved || run.method != "radiosity") continue;
    elements[run.is_refined].push_back({static_cast<double>(run.elements), run.error});
    cpu[run.is_refined].push_back({run.cpu_s, run.error});
    smallest[run.is_refined] = std::min(smallest[run.is_refined], run.error);
    largest[run.is_refined] = std::max(largest[run.is_refined], run.error);
  }
  const double error = std::max(smallest[0], smallest[1]);
  if (elements[0].empty() || elements[1].empty() || error > std::min(largest[0], largest[1])) return std::nullopt;
  return RefinementGain{error, cost_at(error, elements[0]) / cost_at(error, elements[1]),
                        cost_at(error, cpu[0]) / cost_at(error, cpu[1])};
}

}  // namespace

std::vector<std::uint32_t> ElementRange::fineness() const {
  std::vector<std::uint32_t> all;
  for (std::uint32_t f = 1; f <= 8 && least * f * f <= most; f *= 2) all.push_back(f);
  return all;
}

std::vector<std::uint32_t> ElementRange::doubled() const {
  std::vector<std::uint32_t> all;
  for (std::uint64_t n = least; n <= most; n *= 2) all.push_back(static_cast<std::uint32_t>(n));
  return all;
}

void judge(ErrorReport& report) {
  report.truth_error = standard_error(report.truth.irradiance);
  std::vector<std::size_t> resolved, traced;
  for (std::size_t k = 0; k < report.runs.size(); ++k) {
    ErrorRun& run = report.runs[k];
    const double error = without_noise(relative_error(run.irradiance, report.truth.irradiance), report.truth_error);
    run.resolved = error > report.truth_error;
    run.error = std::max(error, report.truth_error);
    run.on_frontier = false, run.ratio = 0;
    if (run.resolved) resolved.push_back(k);
    if (run.resolved && run.is_reference()) traced.push_back(k);
  }
  for (const std::size_t k : frontier(costs_of(report.runs, resolved))) report.runs[resolved[k]].on_frontier = true;
  report.refinement = gain_of_refinement(report.runs);
  if (traced.empty()) return;
  const SquareRootLaw path_tracing(costs_of(report.runs, traced));
  for (const std::size_t k : resolved)
    if (ErrorRun& run = report.runs[k]; !run.is_reference()) run.ratio = path_tracing.cpu_s(run.error) / run.cpu_s;
}

Expected<ErrorReport> error_report(const BenchCase& scene, const std::string& name, const ErrorOptions& options,
                                   std::optional<Truth> known, const ShowProgress& show) {
  ErrorReport report;
  report.scene = name;
  const bool is_known = known.has_value();
  if (is_known)
    report.truth = std::move(*known);
  else
    report.truth.points = surface_points(*scene.mesh(), options.points, points_seed);
  if (Status measured = Sweep(scene, name, options, show, report).all(); !measured) return measured.error();
  if (!is_known)
    if (Status found = find_truth(scene, options, show, report); !found) return found.error();
  judge(report);
  std::vector<Vec2> growth;
  for (const GrowthRun& run : report.growth) growth.push_back({static_cast<double>(run.elements), run.cpu_s});
  if (growth.size() > 1 && report.growth.front().elements != report.growth.back().elements)
    report.growth_exponent = log_log_slope(growth);
  return report;
}

}  // namespace lichthof::bench
