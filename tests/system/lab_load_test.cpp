/// A lab of real processes at work: stopped in the middle of it, with a slow node, and over a long time.
#include <doctest/doctest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <map>
#include <numeric>

#include "core/base/random.hpp"
#include "tests/system/real_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

constexpr double stopped_within_s = 5;
constexpr double most_slowdown = 1.35;          // by one node of four that becomes ten times slower
constexpr double most_growth_mib = 32;          // of a process between the second and the last quarter of a soak
constexpr std::uint32_t most_kills_of_job = 2;  // the third would end it by name

void pause_s(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

double resident_mib(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1u << 20);
}

/// A process that runs 10 ms of every 100 ms while this lives.
class Slowed {
 public:
  explicit Slowed(pid_t process)
      : beat_([this, process] {
          while (!over_) {
            ::kill(process, SIGSTOP);
            pause_s(0.09);
            ::kill(process, SIGCONT);
            pause_s(0.01);
          }
        }) {}
  ~Slowed() {
    over_ = true;
    beat_.join();
  }

 private:
  std::atomic<bool> over_{false};
  std::thread beat_;
};

double mean(const std::vector<double>& values, std::size_t from, std::size_t to) {
  return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(from),
                         values.begin() + static_cast<std::ptrdiff_t>(to), 0.0) /
         static_cast<double>(to - from);
}

void expect_flat(const std::string& name, const std::vector<double>& mib) {
  REQUIRE(mib.size() >= 4);
  const std::size_t n = mib.size();
  const double early = mean(mib, n / 4, n / 2), late = mean(mib, 3 * n / 4, n);
  MESSAGE(name << ": " << early << " MiB in the second quarter, " << late << " in the last; " << mib.front()
               << " at first, " << mib.back() << " at last");
  CHECK(late - early < most_growth_mib);
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("lab load: SIGTERM under load ends every process in time, and leaves no port and no job behind") {
    const std::vector<std::string> names{"anna", "bert", "carl"};
    RealLab lab(names);
    Random random(Trials::asked().seed);
    std::vector<std::string> jobs;
    double longest_s = 0;
    for (std::uint32_t trial = 0; trial < Trials::asked().stops; ++trial) {
      CAPTURE(trial);
      if (jobs.empty() || lab.is_over(jobs.back())) jobs.push_back(lab.submit("1e-5"));
      REQUIRE(lab.until([&] { return lab.job_state(jobs.back()) != "queued"; }));
      pause_s(2 * random.unit());
      const auto stop = [&](Process& process) {
        process.signal(SIGTERM);
        const Outcome outcome = process.finish();
        longest_s = std::max(longest_s, outcome.seconds);
        INFO(outcome.err);
        CHECK(outcome.seconds < stopped_within_s);
        CHECK(outcome.status == 0);
      };
      const std::size_t turn = random.below(static_cast<std::uint32_t>(names.size()) + 1);
      for (std::size_t k = 0; k < turn; ++k) stop(lab.node(names[k]));
      stop(lab.controller());
      for (std::size_t k = turn; k < names.size(); ++k) stop(lab.node(names[k]));
      CHECK(lab.ports_are_free());
      lab.start_controller();
      for (const std::string& name : names) lab.start(name);
      REQUIRE(lab.until([&] { return lab.node_count() == names.size(); }));
    }
    MESSAGE("stopped after " << longest_s << " s at most");
    for (const std::string& job : jobs) lab.expect_done(job);
  }

  TEST_CASE("lab load: a node that becomes ten times slower delays a job, and changes nothing else") {
    RealLab lab({"anna", "bert", "carl", "dora"});
    const std::uint32_t elements = Trials::asked().slow_elements;
    const std::string undisturbed = lab.submit("1e-5", elements);
    lab.expect_done(undisturbed);
    const std::string id = lab.submit("1e-5", elements);
    REQUIRE(lab.until([&] { return lab.is_in(id, "radiosity"); }));
    {
      const Slowed slowed(lab.node("carl").id());
      lab.expect_done(id);
    }
    const double ratio = lab.job(id)["seconds"].get<double>() / lab.job(undisturbed)["seconds"].get<double>();
    MESSAGE(ratio << " times the " << lab.job(undisturbed)["seconds"].get<double>() << " s of an undisturbed job");
    WARN(ratio < most_slowdown);
    CHECK(difference(lab.picture(id), lab.picture(undisturbed)) < 5e-3);
    CHECK(lab.node_count() == 4);
  }

  TEST_CASE("lab load: a soak of jobs, joins and kills costs neither a job nor memory") {
    RealLab lab({"anna", "bert", "carl", "dora"});
    Random random(Trials::asked().seed);
    std::vector<std::string> all;
    std::map<std::string, std::uint32_t> kills_of;  // of jobs that have not ended
    std::vector<double> controller_mib, anna_mib;
    std::map<std::string, double> back_at;  // who is down
    std::uint32_t kills = 0, joins = 0;
    double next_kill = now_s() + 3;
    // Users fetch what they asked for; a lab full of results that nobody has fetched takes no more jobs.
    const auto end = [&](const std::string& id) {
      const nlohmann::json job = lab.job(id);
      INFO(job.dump());
      CHECK(job["state"] == "done");
      CHECK(!lab.picture(id).empty());
    };
    for (const double until = now_s() + Trials::asked().soak_s; now_s() < until; pause_s(0.5)) {
      for (const auto& [id, count] : kills_of)
        if (lab.is_over(id)) end(id);
      std::erase_if(kills_of, [&](const auto& job) { return lab.is_over(job.first); });
      if (kills_of.size() < 2) {
        all.push_back(lab.submit(random.below(2) ? "1e-5" : "1e-4", 2000 + 1000 * random.below(6)));
        kills_of[all.back()] = 0;
      }
      controller_mib.push_back(resident_mib(lab.controller().id()));
      anna_mib.push_back(resident_mib(lab.node("anna").id()));
      for (auto at = back_at.begin(); at != back_at.end();) {
        const bool is_back = now_s() >= at->second;
        if (is_back) lab.start(at->first), ++joins;
        at = is_back ? back_at.erase(at) : std::next(at);
      }
      const bool may_kill =
          std::all_of(kills_of.begin(), kills_of.end(), [](const auto& job) { return job.second < most_kills_of_job; });
      if (now_s() < next_kill || !may_kill) continue;
      const std::string victim = std::vector<std::string>{"bert", "carl", "dora"}[random.below(3)];
      if (back_at.contains(victim)) continue;
      lab.node(victim).signal(random.below(3) ? SIGKILL : SIGTERM);
      lab.node(victim).finish();
      for (auto& [id, count] : kills_of) ++count;
      ++kills;
      back_at[victim] = now_s() + 5 * random.unit();
      next_kill = now_s() + 3 + 10 * random.unit();
    }
    for (const auto& [name, at] : back_at) lab.start(name);
    for (const auto& [id, count] : kills_of) {
      REQUIRE(lab.until([&] { return lab.is_over(id); }));
      end(id);
    }
    MESSAGE(all.size() << " jobs, " << kills << " nodes ended, " << joins << " joined");
    const nlohmann::json listed = lab.asked({"jobs"})["jobs"];
    // As many as a controller keeps, and the last two, which count from the next submit on.
    const std::size_t kept = std::min<std::size_t>(all.size(), 2000);
    CHECK(listed.size() >= kept);
    CHECK(listed.size() <= kept + 2);
    for (const nlohmann::json& job : listed) {
      INFO(job.dump());
      CHECK(job["state"] == "done");
    }
    lab.expect_done(all.back());
    expect_flat("controller", controller_mib), expect_flat("anna", anna_mib);
  }
}
