/// Failures in a lab of real processes: nodes and the controller are killed and stopped at seeded moments, and every job ends
/// as if nothing had happened. LICHTHOF_TRIALS=long makes the trials as many as the promises name.
#include <doctest/doctest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/base/random.hpp"
#include "tests/system/real_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

// Promises, with what a busy machine and a look every second add to them.
constexpr double noticed_within_s = 10 + 1, resumed_within_s = 5 + 10, most_lost_s = 10 + 5;
// Of the ledger and of light between two runs of the tiled room: floats that were summed in another order.
constexpr double most_difference = 1e-6;

void pause_s(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

/// Seconds between the light that was kept last and a moment in UTC, by the job's log, whose stamps are of whole seconds.
double lost_s(const std::string& log, double at) {
  double kept = 0;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("kept the light") == std::string::npos && line.find("epoch 1:") == std::string::npos) continue;
    std::tm utc{};
    if (!strptime(line.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc)) continue;
    const double stamp = static_cast<double>(timegm(&utc));
    if (stamp <= at) kept = stamp;
  }
  REQUIRE(kept > 0);
  return at - kept;
}

double utc_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

/// When each pass of an undisturbed job begins and ends, so that failures can be drawn from all of it.
struct Course {
  std::string id;
  double radiosity_s = 0, picture_s = 0;
};
Course undisturbed(RealLab& lab, const std::string& eps) {
  Course course{lab.submit(eps)};
  REQUIRE(lab.until([&] { return lab.is_in(course.id, "radiosity") || lab.is_over(course.id); }));
  const double begun = now_s();
  REQUIRE(lab.until([&] { return lab.is_in(course.id, "picture") || lab.is_over(course.id); }));
  const double lit = now_s();
  lab.expect_done(course.id);
  course.radiosity_s = lit - begun;
  course.picture_s = std::max(0.1, lab.job(course.id)["seconds"].get<double>() - course.radiosity_s);
  return course;
}

/// Light of the tiled room is the same in whatever order its shots are made: what was lost, or arrived twice, shows.
void expect_same_light(RealLab& lab, const std::string& id, const std::string& expected) {
  const nlohmann::json one = lab.job(id), other = lab.job(expected);
  INFO(one.dump() << "\n" << other.dump());
  CHECK(std::abs(one["energy"]["residual"].get<double>() - other["energy"]["residual"].get<double>()) <
        most_difference);
  CHECK(difference(lab.light(id), lab.light(expected)) < most_difference);
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("lab: kill -9 of one node and of two, in each pass, loses nothing") {
    RealLab lab({"anna", "bert", "carl", "dora"});
    const std::string tiles = lab.submit_tiles();
    const Course whole = undisturbed(lab, "1e-5");
    const nlohmann::json expected = lab.job(whole.id);
    lab.expect_done(tiles);
    Random random(Trials::asked().seed);
    double most_s = 0;
    for (std::uint32_t trial = 0; trial < Trials::asked().kills; ++trial)
      for (const std::string pass : {"radiosity", "picture"})
        for (const std::size_t count : {1u, 2u}) {
          const double moment = random.unit() * (pass == "radiosity" ? whole.radiosity_s : whole.picture_s);
          std::vector<std::string> names{"anna", "bert", "carl", "dora"}, victims;
          for (; victims.size() < count; names.erase(names.begin()))
            std::swap(names.front(), names[random.below(static_cast<std::uint32_t>(names.size()))]),
                victims.push_back(names.front());
          INFO("trial " << trial << ": " << count << " nodes, " << moment << " s into the " << pass);
          const std::string id = lab.submit("1e-5"), beside = lab.submit_tiles();
          REQUIRE(lab.until([&] { return lab.is_in(id, pass) || lab.is_over(id); }));
          pause_s(moment);
          const double killed = utc_s();
          for (const std::string& victim : victims) lab.kill(victim);
          lab.expect_done(id);
          const nlohmann::json job = lab.job(id);
          // Rays and hemicubes stand where a shot's light leaves, so the order of shots moves the ledger by some 1e-4; a shot
          // that was lost or counted twice would move it by more.
          const double residual = job["energy"]["residual"], undisturbed_residual = expected["energy"]["residual"];
          CHECK(std::abs(residual - undisturbed_residual) < 1e-3);
          CHECK(difference(lab.picture(id), lab.picture(whole.id)) < 5e-3);
          lab.expect_done(beside);
          expect_same_light(lab, beside, tiles);
          if (pass == "radiosity") most_s = std::max(most_s, lost_s(lab.log(id), killed));
          for (const std::string& victim : victims) lab.start(victim);
          REQUIRE(lab.until([&] { return lab.node_count() == 4; }));
        }
    MESSAGE("at most " << most_s << " s of work lost");
    CHECK(most_s < most_lost_s);
  }

  TEST_CASE("lab: a node that hangs is noticed, and counts for nothing when it comes back") {
    RealLab lab({"anna", "bert", "carl"});
    const std::string whole = lab.submit_tiles();
    lab.expect_done(whole);
    // Jobs enough that some are under way when the node comes back with what it wanted to say.
    std::vector<std::string> jobs;
    for (int k = 0; k < 3; ++k) jobs.push_back(lab.submit_tiles());
    REQUIRE(lab.until([&] { return lab.is_in(jobs[0], "radiosity"); }));
    lab.node("bert").signal(SIGSTOP);
    const double stopped = now_s();
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    MESSAGE("noticed after " << now_s() - stopped << " s");
    CHECK(now_s() - stopped < noticed_within_s);
    while (now_s() - stopped < Trials::asked().hang_s) {
      if (lab.is_over(jobs.back())) jobs.push_back(lab.submit_tiles());
      pause_s(0.2);
    }
    jobs.push_back(lab.submit_tiles());
    lab.node("bert").signal(SIGCONT);
    REQUIRE(lab.until([&] { return lab.node_count() == 3; }));
    // Shorter than anybody notices: what it was sent meanwhile is all there.
    jobs.push_back(lab.submit_tiles());
    REQUIRE(lab.until([&] { return lab.is_in(jobs.back(), "radiosity"); }));
    lab.node("anna").signal(SIGSTOP);
    pause_s(2);
    lab.node("anna").signal(SIGCONT);
    for (const std::string& job : jobs) {
      lab.expect_done(job);
      expect_same_light(lab, job, whole);
    }
  }

  TEST_CASE("lab: a node stopped during the picture, and going on later, leaves the picture as it is") {
    RealLab lab({"anna", "bert", "carl"});
    const std::string id = lab.submit("1e-3");
    REQUIRE(lab.until([&] { return lab.is_in(id, "picture") || lab.is_over(id); }));
    lab.node("bert").signal(SIGSTOP);
    pause_s(3);
    lab.node("bert").signal(SIGCONT);
    lab.expect_done(id);
    CHECK(lab.node_count() == 3);
  }

  TEST_CASE("lab: a controller killed with -9 at any moment takes its jobs up again") {
    RealLab lab({"anna", "bert"});
    const Course whole = undisturbed(lab, "1e-5");
    Random random(Trials::asked().seed);
    std::vector<std::string> jobs;
    double longest_s = 0;
    for (std::uint32_t trial = 0; trial < Trials::asked().restarts; ++trial) {
      jobs.push_back(lab.submit("1e-5"));
      jobs.push_back(lab.submit("1e-4"));
      REQUIRE(lab.until([&] { return lab.job(jobs[jobs.size() - 2]).value("checkpoint", false); }));
      pause_s(random.unit() * (whole.radiosity_s + whole.picture_s));
      lab.kill_controller();
      // What a controller that died while writing leaves behind: half a file, or anything at all.
      const std::string kept = contents(lab.state("jobs"));
      std::ofstream(lab.state("jobs.part"), std::ios::binary)
          << (trial % 2 ? std::string(1000, '\xa5') : kept.substr(0, kept.size() / 2));
      const double restarted = now_s();
      lab.start_controller();
      const auto goes_on = [&] {
        return std::any_of(jobs.begin(), jobs.end(), [&](const auto& id) { return lab.job_state(id) == "running"; }) ||
               std::all_of(jobs.begin(), jobs.end(), [&](const auto& id) { return lab.is_over(id); });
      };
      REQUIRE(lab.until(goes_on));
      longest_s = std::max(longest_s, now_s() - restarted);
    }
    MESSAGE("resumed after " << longest_s << " s at most");
    CHECK(longest_s < resumed_within_s);
    for (const std::string& job : jobs) lab.expect_done(job);
  }

  TEST_CASE("lab: a controller whose own file is torn says so and touches nothing") {
    RealLab lab({"anna"});
    lab.expect_done(lab.submit("1e-3"));
    lab.kill_controller();
    const std::string kept = contents(lab.state("jobs")), torn = kept.substr(0, kept.size() - 7);
    std::ofstream(lab.state("jobs"), std::ios::binary | std::ios::trunc) << torn;
    const Outcome refused = ran({"controller", "--port", "0", "--node-port", "0", "--state", lab.state("")});
    CHECK(refused.status == 2);
    CHECK(refused.complains("is damaged"));
    CHECK(contents(lab.state("jobs")) == torn);
  }
}
