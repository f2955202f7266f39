/// Section `error`: run time against error. Every method runs through its settings on one scene, in one process; the truth
/// is path traced afterwards, as long as the smallest error among them asks for. How the cost of the first pass grows with
/// the elements is measured as well.
///
/// What counts as run time: CPU seconds of one thread from a scene in memory to irradiance at all points, so everything
/// but the program's start and the reading of the scene. Runs that share a first pass each count it whole.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/bench_case.hpp"
#include "bench/frontier.hpp"
#include "bench/section.hpp"
#include "bench/truth.hpp"

namespace lichthof::bench {

/// Numbers of elements, from the least to the most.
struct ElementRange {
  std::uint32_t least = 0, most = 0;
  std::vector<std::uint32_t> doubled() const;  ///< each twice the one before
  /// Elements along each side of what is one in the least mesh: 1, 2, 4, 8. Each mesh has four times those of the one before.
  std::vector<std::uint32_t> fineness() const;
};

struct ErrorOptions {
  ElementRange elements{1500, 48000};  ///< of the meshes that errors are measured on
  ElementRange growth{5000, 320000};   ///< of those for the growth of cost while shooters stay as they are
  std::uint32_t points = 2000;         ///< random surface points
  std::uint32_t most_paths = 32768;    ///< of the truth, at each point
};

/// One setting of one method.
struct ErrorRun {
  std::string method;          ///< as --method has it
  bool is_refined = false;     ///< the mesh is finer where the light asks for it; else its elements are alike
  std::uint32_t elements = 0;  ///< of the mesh; 0: none
  double eps = 0;
  std::uint32_t rays = 0;  ///< at each point: of the final gather, or paths; 0: the first pass, interpolated
  std::uint32_t direct_rays =
      0;  ///< likewise, to luminaires; 0: their light as the first pass has it, or part of the paths
  double cpu_s = 0;
  std::vector<Rgb> irradiance;  ///< at the points (W/m²)
  double error = 0;             ///< without the truth's own; not resolved: a bound above it
  bool resolved = true;         ///< the error is not below the standard error of the truth
  double ratio = 0;             ///< CPU time of path tracing to the same error : that of this run; 0: not known
  bool on_frontier = false;     ///< no other run is as quick and as exact
  bool is_reference() const { return elements == 0; }
};

/// A first pass with the default eps on a mesh of so many elements, the patches of all being the same.
struct GrowthRun {
  std::uint64_t elements = 0, shots = 0;
  double cpu_s = 0;
};

/// Uniform meshes : refined ones, both read as they are, at the smallest error that both reach.
struct RefinementGain {
  double error = 0, elements = 0, cpu = 0;
};

struct ErrorReport {
  std::string scene;  ///< a short name
  Truth truth;
  double truth_error = 0;  ///< standard error of the truth, as a share of its RMS
  std::vector<ErrorRun> runs;
  std::optional<RefinementGain> refinement;
  std::vector<GrowthRun> growth;
  double growth_exponent = 0;  ///< CPU time ~ elements^exponent; 0: fewer than two meshes
};

/// Measures all of it.
/// @param known  the truth where it is known; its points count then, else random ones
/// @param show   what is under way and the share of it that is done
/// @error interrupted
using ShowProgress = std::function<void(const std::string& what, double share_done)>;
Expected<ErrorReport> error_report(const BenchCase& scene, const std::string& name, const ErrorOptions& options,
                                   std::optional<Truth> known, const ShowProgress& show);

/// Fills error, resolved, ratio and on_frontier of all runs from their irradiance, and truth_error and refinement.
void judge(ErrorReport& report);

/// What is worth a goal: "growth", the worst of all scenes, "refinement", the best of all, and for each scene what path tracing costs at
/// equal errors.
Section error_section(std::span<const ErrorReport> reports);
/// All runs: {"runs": [{"method", "refined", "elements", "eps", "rays", "direct_rays", "cpu_s", "error", "resolved", "ratio",
/// "on_frontier"}],
/// "growth_runs": [...], "truth": {...}}
nlohmann::json runs_json(const ErrorReport& report);
/// The same as a table.
std::vector<std::string> table(const ErrorReport& report);
/// The same as a plot: a panel for each scene, and one for the growth of cost.
std::string plot(std::span<const ErrorReport> reports, const std::string& caption);

}  // namespace lichthof::bench
