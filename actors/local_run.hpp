/// A whole pass inside this one process: the same actors as on a cluster, on one CAF actor system. This file knows how many
/// of them there are and which threads they get; callers know nothing of CAF.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "core/base/parallel.hpp"
#include "core/cluster/controller.hpp"
#include "core/light/solution.hpp"
#include "core/scene/partition.hpp"
#include "core/tracing/balancer.hpp"
#include "core/tracing/column_source.hpp"
#include "core/tracing/image.hpp"

namespace lichthof::actors {

class Meters;

/// First pass. Cells are actors on a single scheduler thread, which lends itself to the steps; inside a step `parallel`
/// uses all cores (one thread pool, never two that fight). One thread at a time steps, messages are served first in,
/// first out: the run is repeatable, whatever the number of threads in `parallel`.
struct SolveRun {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const CellGrid> grid;
  SolveOptions options;
  std::shared_ptr<const Parallel> parallel;
  const Solution* resume = nullptr;         ///< continue from here; same scene and mesh
  const std::atomic<bool>* stop = nullptr;  ///< set by a signal: end early, keep what was reached
  std::function<void(const RadiosityProgress&)>
      progress;                    ///< a few times a second and at the end, on the calling thread
  std::shared_ptr<Meters> meters;  ///< to watch the actors by; may be empty
};
/// @returns the solution reached; converged = false when it was stopped. Counters are those of this run alone. A stopped run
///          lets the shots under way arrive, so that it can be resumed without a loss; after two seconds it no longer waits
/// @error   std::runtime_error with the reason when an actor failed; what `progress` throws. No actor is left in any case
Solution solve(const SolveRun& run);

/// Second pass: a balancer actor and `workers` worker actors, each on a thread of its own.
struct TraceRun {
  std::shared_ptr<const ColumnSource> source;
  unsigned workers = 1;
  Scheduling scheduling = Scheduling::adaptive;
  const std::atomic<bool>* stop = nullptr;
  std::function<void(double share_done)> progress;  ///< a few times a second; may be empty
  std::shared_ptr<Meters> meters;                   ///< to watch the actors by; may be empty
};
struct TraceResult {
  Image image;
  std::uint64_t rays = 0;
  std::uint32_t jobs = 0;
  double seconds = 0;
  double idle_seconds = 0;  ///< sum over workers of the time from their last result to the end
  bool complete = false;
};
/// @returns the picture; complete = false when it was stopped. Its bits don't depend on the number of workers
/// @error   as above; a worker that fails is replaced by the others, only without any worker left the pass has failed
TraceResult trace(const TraceRun& run);

}  // namespace lichthof::actors
