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
      sum.moves += report.moves;
      sum.second_runs += report.second_runs;
      sum.late_hostings += report.late_hostings;
      sum.late_checkpoints += report.late_checkpoints;
    }
    MESSAGE(sum.events << " events, " << sum.jobs << " jobs: " << sum.done << " done, " << sum.failed << " failed, "
                       << sum.cancelled << " cancelled; " << sum.restarts << " restarts, " << sum.drops << " drops, "
                       << sum.hostings << " hostings, " << sum.resumed << " of them resumed, " << sum.joined_pictures
                       << " during a picture; " << sum.drained << " nodes drained; " << sum.moves << " moves, "
                       << sum.second_runs << " columns run twice, " << sum.late_hostings << " hostings and "
                       << sum.late_checkpoints << " checkpoints never answered");
    if (wanted) return;
    // The stories are worth telling: every rule has been at work many times.
    for (const std::uint64_t often :
         {sum.done, sum.failed, sum.cancelled, sum.restarts, sum.drops, sum.resumed, sum.joined_pictures, sum.drained,
          sum.moves, sum.second_runs, sum.late_hostings, sum.late_checkpoints})
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

  TEST_CASE("lab: radiosity on eight nodes takes 1.35 times as long at most when one becomes ten times slower") {
    JobWish wish;
    wish.picture = false;
    wish.grid = {8, 7, 1};  // as many for each of eight as for each of seven
    wish.patches.assign(56, 600);
    for (const double at_s : {2.0, 7.0, 13.0, 20.0, 30.0, 38.0}) {
      LabRunOptions options;
      options.with_faults = false;
      options.wish = wish;
      options.only = OneFault{{static_cast<std::int64_t>(1e9 * at_s)}, 1, {}};
      const LabReport usual = LabRun(options).run();
      options.only->pace = 0.1;
      const LabReport slow = LabRun(options).run();
      CHECK_MESSAGE(slow.broken.empty(), slow.broken);
      CHECK(usual.moves == 0);
      CHECK(slow.done == 1);
      CHECK(slow.moves == 1);
      CAPTURE(at_s);
      CHECK(double(slow.end.ns) < 1.35 * double(usual.end.ns));
    }
  }

  TEST_CASE("lab: a node that hangs does not hold up the picture, whose columns are run a second time") {
    JobWish wish;
    wish.radiosity = false;
    wish.patches = {1000};
    LabRunOptions options;
    options.with_faults = false;
    options.wish = wish;
    options.only = OneFault{{1'000'000'000}, 1, {}};
    const LabReport usual = LabRun(options).run();
    REQUIRE(usual.done == 1);
    std::uint64_t second_runs = 0;
    for (int tenth = 1; tenth < 40; ++tenth) {
      options.only = OneFault{{1'000'000'000 + tenth * 100'000'000LL}, 1, {50'000'000'000}};
      const LabReport report = LabRun(options).run();
      CHECK_MESSAGE(report.broken.empty(), report.broken);
      CHECK(report.done == 1);
      CHECK(report.drops == 0);
      // Seven work for eight, hosting waits a while, and who does a column again begins it anew.
      CHECK(double(report.end.ns) < 1.5 * double(usual.end.ns) + 2.5e9);
      second_runs += report.second_runs;
    }
    CHECK(second_runs > 0);
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
