/// The dispatcher among nodes that crash, hang, come late and fill up: one seed is one story.
/// LICHTHOF_LAB_SEED=N replays a single one.
#include <doctest/doctest.h>

#include <cstdlib>
#include <string>

#include "sim/lab_run.hpp"

using namespace lichthof;
using namespace lichthof::sim;

namespace {

LabReport report_of(std::uint64_t seed, bool with_faults) {
  LabRunOptions options;
  options.seed = seed;
  options.with_faults = with_faults;
  return LabRun(options).run();
}

std::string replay(std::uint64_t seed) {
  return "LICHTHOF_LAB_SEED=" + std::to_string(seed) + " build/release/sim_tests -tc='lab: whatever*'";
}

}  // namespace

TEST_SUITE("lab") {
  TEST_CASE("lab: whatever a seed makes go wrong, the rules hold after every event and every job ends") {
    const char* wanted = std::getenv("LICHTHOF_LAB_SEED");
    const std::uint64_t first = wanted ? std::strtoull(wanted, nullptr, 10) : 1;
    const std::uint64_t count = wanted ? 1 : 1000;
    LabReport sum;
    for (std::uint64_t seed = first; seed < first + count; ++seed) {
      const LabReport report = report_of(seed, true);
      CHECK_MESSAGE(report.broken.empty(), report.broken << "; replay: " << replay(seed));
      sum.jobs += report.jobs;
      sum.events += report.events;
      sum.done += report.done;
      sum.failed += report.failed;
      sum.cancelled += report.cancelled;
      sum.restarts += report.restarts;
      sum.drops += report.drops;
      sum.hostings += report.hostings;
      sum.resumed += report.resumed;
      sum.joined_pictures += report.joined_pictures;
      sum.drained += report.drained;
    }
    MESSAGE(sum.events << " events, " << sum.jobs << " jobs: " << sum.done << " done, " << sum.failed << " failed, "
                       << sum.cancelled << " cancelled; " << sum.restarts << " restarts, " << sum.drops << " drops, "
                       << sum.hostings << " hostings, " << sum.resumed << " of them resumed, " << sum.joined_pictures
                       << " during a picture; " << sum.drained << " nodes drained");
    if (wanted) return;
    // The stories are worth telling: every rule has been at work many times.
    for (const std::uint64_t often :
         {sum.done, sum.failed, sum.cancelled, sum.restarts, sum.drops, sum.resumed, sum.joined_pictures, sum.drained})
      CHECK(often >= 50);
    CHECK(sum.done * 2 > sum.jobs);
  }

  TEST_CASE("lab: where nothing goes wrong every job that fits is done, none is lost, none cancelled") {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const LabReport report = report_of(seed, false);
      CHECK_MESSAGE(report.broken.empty(), report.broken);
      CHECK(report.drops == 0);
      CHECK(report.cancelled == 0);
      CHECK(report.done + report.failed == report.jobs);
    }
  }

  TEST_CASE("lab: a seed tells the same story twice") {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const LabReport one = report_of(seed, true), two = report_of(seed, true);
      CHECK(one.events == two.events);
      CHECK(one.end == two.end);
      CHECK(one.hostings == two.hostings);
    }
  }
}
