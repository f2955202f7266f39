#include <cmath>
#include <thread>

#include "bench/sections.hpp"

namespace lichthof::bench {

namespace {

/// RMS over the area of the difference, over the RMS of `truth`.
double relative_difference(const Mesh& mesh, const std::vector<Rgbf>& some, const std::vector<Rgbf>& truth) {
  double difference = 0, whole = 0;
  for (std::size_t e = 0; e < truth.size(); ++e) {
    const Rgb d = Rgb{some[e]} - Rgb{truth[e]}, t{truth[e]};
    difference += mesh.elements[e].area * glm::dot(d, d);
    whole += mesh.elements[e].area * glm::dot(t, t);
  }
  return whole > 0 ? std::sqrt(difference / whole) : 0;
}

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

Expected<Section> cells_section(const BenchCase& scene) {
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  Section section{"cells", {}};
  const Expected<const Solution*> one = scene.solution();
  if (!one) return one.error();
  section.add("1/shots", "1 cell: shots", static_cast<double>((*one)->counters.shots));
  for (const std::string cells : {"2", "4", "8", "2x2x2"}) {
    const Expected<Solved> solved = scene.solve(cells, threads);
    if (!solved) return solved.error();
    const SolveCounters& counters = solved->solution.counters;
    const auto add = [&](const std::string& key, const std::string& text, double value, const std::string& unit = "",
                         std::optional<Goal> goal = {}) {
      section.add(cells + "/" + key, cells + " cells: " + text, value, unit, goal);
    };
    add("difference", "RMS difference to 1 cell",
        relative_difference(*scene.mesh(), solved->solution.irradiance, (*one)->irradiance));
    add("shots", "shots", static_cast<double>(counters.shots));
    add("cpu_s", "CPU time", solved->cpu_s, "s");
    add("messages", "hemicube messages", static_cast<double>(counters.messages));
    add("bytes_per_message", "bytes per message", share(counters.bytes_sent, counters.messages), "B");
    add("bitmap_ratio", "bitmaps R = 128, compressed : raw", share(counters.bitmap_bytes, counters.bitmap_bytes_raw),
        "", at_most(0.10));
  }
  return section;
}

}  // namespace lichthof::bench
