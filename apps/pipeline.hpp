/// A run from files to light, in the order things happen: load, mesh, radiosity, rays. Whoever wants to know how the parts
/// of the program fit together reads this pair of files; the commands only choose which of the steps they need.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "apps/common/interruption.hpp"
#include "apps/common/options.hpp"
#include "apps/common/picture_options.hpp"
#include "apps/common/report.hpp"
#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"
#include "core/scene/partition.hpp"
#include "core/scene/scene.hpp"
#include "core/tracing/column_source.hpp"
#include "core/tracing/error_budget.hpp"
#include "core/tracing/error_check.hpp"
#include "core/tracing/image.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/path_tracer.hpp"
#include "core/tracing/probe.hpp"
#include "io/scene_reader.hpp"

namespace lichthof::apps {

struct RunOptions {
  std::string input;  ///< a scene or a solution
  std::string output;
  io::ReadOptions read;
  FirstPassOptions first_pass;
  std::optional<std::string> method;
  unsigned threads = 0;  ///< 0: all
  OutputOptions talk;
};

using LitScenePtr = std::shared_ptr<const LitScene>;

class Run {
 public:
  /// @param default_method  where --method was not given
  Run(const char* command, const RunOptions& options, Method default_method, const Interruption& interruption);

  /// Reads a scene or a solution. What is odd about the scene goes to the log.
  /// @param resumes  the command solves on: options of the first pass may stand beside a solution, but for the mesh
  /// @error bad_input; also when there is no luminaire, unless the method needs none
  Status load(bool resumes);

  /// The first pass: mesh, partition, cells. Continues a solution that was loaded.
  /// @returns also a solution that a signal ended early: converged() tells
  Status solve();
  bool converged() const { return solution_ && solution_->converged; }

  /// Another end for the next solve(), which goes on from what has been solved; or, with another mesh, begins anew.
  void choose(std::optional<std::uint32_t> elements, double eps);
  /// For the next solve(): the mesh with smaller elements where the light of this one strays from planes.
  /// @returns false: all are as fine as they may be
  bool refine(double keep);
  /// How far the light is from the truth at these points, read with these knobs.
  struct Checked {
    ErrorEstimate estimate;
    double unshot = 0;  ///< see parts_of()
    ReadingNoise noise;
  };
  Checked check(const LitScenePtr& scene, const CheckPoints& places, const ErrorKnobs& knobs,
                const ErrorCheckOptions& effort);
  /// @pre solve() or a loaded solution
  LitScenePtr lit_scene() const;
  /// What the progress lines of the passes begin with: "round 2, error .031 so far: ".
  void say_before(std::string text) { before_ = std::move(text); }
  /// Why the ledger of the first pass does not close, as a warning; nothing where it does.
  void warn_of_ledger() const;

  /// Writes the solution. @error io
  Status keep(const std::string& path);

  /// Camera for a picture: what was asked for, checked against the walls.
  Expected<Camera> camera(const PictureOptions& wanted) const;

  /// The second pass. @error interrupted when a signal came: no picture then
  Expected<Image> picture(const Camera& camera, const PictureOptions& wanted);

  /// Irradiance (W/m²) at sensor points by the run's method.
  std::vector<Rgb> irradiance(std::span<const SensorPoint> points, const ErrorKnobs& knobs);
  /// The same without a first pass, by paths from the points, where that costs less and is as exact.
  /// @returns nothing: it does not, or an option asks for a first pass
  std::optional<std::vector<Rgb>> irradiance_by_paths(std::span<const SensorPoint> points);
  /// The same by path tracing, with standard errors.
  std::vector<Estimate> reference_irradiance(std::span<const SensorPoint> points, std::uint32_t samples);

  Method method() const { return method_; }
  const FirstPassOptions& first_pass() const { return options_.first_pass; }
  const FileFrame& frame() const { return frame_; }
  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  const std::optional<Solution>& solution() const { return solution_; }

  /// What to report, up to now.
  RunRecord& record();

 private:
  Status load_scene();
  Status load_solution(bool resumes);
  Status expect_light() const;
  MeshOptions mesh_options() const;
  void warn_once(const std::string& line);
  Status mesh();
  Status divide();
  SolveOptions solve_options() const;
  std::unique_ptr<const ColumnSource> column_source(const Camera& camera, const PictureOptions& wanted) const;

  RunOptions options_;
  Method method_;
  const Interruption& interruption_;
  std::shared_ptr<const Parallel> parallel_;
  Stopwatch since_start_;
  RunRecord record_;
  std::string before_;

  std::shared_ptr<const Scene> scene_;
  FileFrame frame_;  ///< of the numbers users write
  std::shared_ptr<const Mesh> mesh_;
  std::shared_ptr<const CellGrid> grid_;
  std::optional<Solution> solution_;
};

}  // namespace lichthof::apps
