/// One scene made ready for all sections: its mesh, its solution in any number of cells, its picture.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "actors/local_run.hpp"
#include "core/base/expected.hpp"
#include "core/light/solution.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/partition.hpp"
#include "core/scene/scene.hpp"
#include "core/tracing/column_source.hpp"

namespace lichthof::bench {

/// A solution and what it took.
struct Solved {
  Solution solution;
  double cpu_s = 0;  ///< of all threads
  double wall_s = 0;
};

class BenchCase {
 public:
  /// @param stop  a set flag ends what is under way
  /// @param repeat  rounds of each measurement, ≥ 1; the best counts
  BenchCase(std::shared_ptr<const Scene> scene, unsigned repeat, const std::atomic<bool>& stop);

  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  const std::shared_ptr<const Mesh>& mesh() const { return mesh_; }
  unsigned repeat() const { return repeat_; }
  bool stopped() const { return stop_.load(); }
  static Error interrupted() { return {ErrorCode::interrupted, "", "interrupted"}; }

  /// The whole first pass with the program's defaults.
  /// @param cells  as --cells: "1", "4", "2x2x2"
  /// @error interrupted; bad_input when the mesh has too few blocks for the cells
  Expected<Solved> solve(const std::string& cells = "1", unsigned threads = 1,
                         TransferMethod method = TransferMethod::rays) const;

  /// The first pass on a mesh of its own, as `--elements N --eps E` make it, in one cell on one thread. What it took counts
  /// meshing too. @param fineness  1, 2, 4 or 8: as many times as fine receivers, on the same shooters @error interrupted
  Expected<Solved> solve_with(std::uint32_t elements, double eps, TransferMethod method,
                              std::uint32_t fineness = 1) const;
  /// The same on that mesh refined where the light asks for it, as `--error` does where the first pass is read as it is. What it
  /// took counts the look at the light. @param keep  see refined_mesh() @error interrupted
  Expected<Solved> solve_refined(std::uint32_t elements, double eps, double keep) const;

  /// The solution in one cell; computed at the first call. @error as solve()
  Expected<const Solution*> solution() const;

  /// The second pass of the scene's first camera, or of one that frames it, 640 x 480, as `render` does it. @error as solve()
  Expected<std::shared_ptr<const ColumnSource>> picture() const;
  /// @error interrupted
  Expected<actors::TraceResult> trace(const std::shared_ptr<const ColumnSource>& source, unsigned workers,
                                      Scheduling scheduling = Scheduling::adaptive) const;

 private:
  /// In one cell on one thread; what it took counts meshing too.
  Expected<Solved> solve_meshed(const SolveOptions& options,
                                const std::function<std::shared_ptr<const Mesh>()>& make_mesh) const;
  Expected<Solved> solve_on(std::shared_ptr<const Mesh> mesh, SolveOptions options, const CellsWanted& cells,
                            unsigned threads) const;

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const Mesh> mesh_;
  unsigned repeat_;
  const std::atomic<bool>& stop_;
  mutable std::shared_ptr<const Solution> solution_;
};

}  // namespace lichthof::bench
