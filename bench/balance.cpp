#include <algorithm>
#include <numeric>

#include "bench/column_play.hpp"
#include "bench/measure.hpp"
#include "bench/sections.hpp"

namespace lichthof::bench {

namespace {

constexpr std::uint32_t paper_workers = 38;
constexpr double message_s = 1e-3;  // a request and its answer on an office network

/// CPU seconds of every column on its own, the least of `repeat` rounds.
Expected<std::vector<double>> column_times(const BenchCase& scene, const ColumnSource& source) {
  std::vector<double> least(source.width(), 1e300);
  std::uint64_t rays = 0;
  for (unsigned round = 0; round < scene.repeat(); ++round)
    for (std::uint32_t column = 0; column < source.width(); ++column) {
      if (scene.stopped()) return BenchCase::interrupted();
      const double start = cpu_s();
      keep(source.columns({column, column + 1}, rays).front().x);
      least[column] = std::min(least[column], cpu_s() - start);
    }
  return least;
}

}  // namespace

Expected<Section> balance_section(const BenchCase& scene) {
  const auto source = scene.picture();
  if (!source) return source.error();
  Section section{"balance", {}};
  for (const auto& [name, scheduling] : {std::pair{"adaptive", Scheduling::adaptive}, {"boxes", Scheduling::boxes}}) {
    double idle = 0, seconds = 1e300;
    std::uint32_t jobs = 0;
    for (unsigned round = 0; round < scene.repeat(); ++round) {
      const Expected<actors::TraceResult> traced = scene.trace(*source, 2, scheduling);
      if (!traced) return traced.error();
      idle += traced->idle_seconds / (2 * traced->seconds) / scene.repeat();
      seconds = std::min(seconds, traced->seconds);
      jobs = traced->jobs;
    }
    const std::string key = name, text = "2 workers, " + key + ": ";
    section.add(key + "/seconds", text + "wall clock, 640 x 480", seconds, "s");
    section.add(key + "/jobs", text + "jobs", jobs);
    section.add(key + "/idle", text + "share of time idle at the end", idle, "",
                scheduling == Scheduling::adaptive ? std::optional(at_most(0.03)) : std::nullopt);
  }
  const Expected<std::vector<double>> times = column_times(scene, **source);
  if (!times) return times.error();
  const auto [cheapest, dearest] = std::minmax_element(times->begin(), times->end());
  section.add("columns/spread", "dearest column : cheapest", *dearest / *cheapest);
  section.add("columns/mean_s", "mean CPU time of a column",
              std::accumulate(times->begin(), times->end(), 0.0) / static_cast<double>(times->size()), "s");
  for (const auto& [name, scheduling] : {std::pair{"adaptive", Scheduling::adaptive}, {"boxes", Scheduling::boxes}}) {
    const Play ideal = played(*times, paper_workers, scheduling, 0);
    const Play real = played(*times, paper_workers, scheduling, message_s);
    const std::string key = std::string(name) + "/simulated_38/", text = std::string("38 workers simulated, ") + name;
    section.add(key + "speed_up", text + ": speed-up", ideal.speed_up);
    section.add(key + "speed_up_1ms", text + ", messages of 1 ms: speed-up", real.speed_up);
    section.add(key + "jobs", text + ": jobs", ideal.jobs);
  }
  return section;
}

}  // namespace lichthof::bench
