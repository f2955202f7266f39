#include <algorithm>

#include "bench/measure.hpp"
#include "bench/sections.hpp"

namespace lichthof::bench {

Expected<Section> threads_section(const BenchCase& scene) {
  double solve_s[2] = {1e300, 1e300}, trace_s[2] = {1e300, 1e300};
  Solution solutions[2];
  Image images[2];
  const auto source = scene.picture();
  if (!source) return source.error();
  for (unsigned round = 0; round < scene.repeat(); ++round)
    for (const unsigned threads : {1u, 2u}) {
      Expected<Solved> solved = scene.solve("1", threads);
      if (!solved) return solved.error();
      solve_s[threads - 1] = std::min(solve_s[threads - 1], solved->wall_s);
      solutions[threads - 1] = std::move(solved->solution);
      Expected<actors::TraceResult> traced = scene.trace(*source, threads);
      if (!traced) return traced.error();
      trace_s[threads - 1] = std::min(trace_s[threads - 1], traced->seconds);
      images[threads - 1] = std::move(traced->image);
    }
  Section section{"threads", {}};
  section.add("radiosity/one_s", "radiosity pass, 1 thread, wall clock", solve_s[0], "s");
  section.add("radiosity/two_s", "radiosity pass, 2 threads, wall clock", solve_s[1], "s");
  section.add("radiosity/ratio", "radiosity pass, 1 thread : 2 threads", solve_s[0] / solve_s[1]);
  const bool same_light = solutions[0].irradiance == solutions[1].irradiance &&
                          solutions[0].direct_irradiance == solutions[1].direct_irradiance &&
                          solutions[0].shot == solutions[1].shot;
  section.add("radiosity/same_bits", "radiosity pass, results bit-identical (1: yes)", same_light, "", at_least(1));
  section.add("rays/one_s", "ray pass 640 x 480, 1 thread, wall clock", trace_s[0], "s");
  section.add("rays/two_s", "ray pass 640 x 480, 2 threads, wall clock", trace_s[1], "s");
  section.add("rays/ratio", "ray pass, 1 thread : 2 threads", trace_s[0] / trace_s[1]);
  section.add("rays/same_bits", "ray pass, pictures bit-identical (1: yes)", images[0] == images[1], "", at_least(1));
  return section;
}

}  // namespace lichthof::bench
