/// A node that works only while its machine's owner is away. The owner is the access time of a file, as he is that of his
/// terminals otherwise.
#include <fcntl.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/system/small_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Somebody who touches his keyboard when he is told to.
class Owner {
 public:
  Owner() : keyboard_(folder_.write("keyboard", "")) { touch(3600); }
  void touch(std::time_t seconds_ago = 0) const {
    const timespec times[2] = {{std::time(nullptr) - seconds_ago, 0}, {0, UTIME_OMIT}};
    REQUIRE(::utimensat(AT_FDCWD, keyboard_.c_str(), times, 0) == 0);
  }
  /// Away after 3 s; what else runs on the machine of this test is none of his.
  SmallLab::Words options() const {
    return {"--idle-only", "--idle-after", "0.05", "--idle-cores", "0", "--owner-files", folder_ / "key*"};
  }

 private:
  Folder folder_;
  std::string keyboard_;
};

constexpr double at_once_s = 8;  // it looks twice a second; the rest is for a busy machine

bool is_over(const std::string& state) { return state == "done" || state == "failed" || state == "cancelled"; }

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("idle: a node yields when its owner comes back, as often as he does, and its job goes on elsewhere") {
    SmallLab lab;
    const Owner owner;
    Process& anna = lab.start("anna", owner.options());
    lab.start("bert");
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    const std::string id = lab.submit(200000);
    const auto works = [&](const nlohmann::json& job) {
      return job.value("state", "") == "running" && job["nodes"].size() == 2;
    };
    int yields = 0;
    for (; yields < 4; ++yields) {  // one more than the nodes a job may kill
      CAPTURE(yields);
      REQUIRE(lab.until([&] { return works(lab.job(id)) || is_over(lab.job(id).value("state", "")); }));
      REQUIRE_FALSE(is_over(lab.job(id).value("state", "")));
      const auto back = Clock::now();
      owner.touch();
      REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
      CHECK(seconds_since(back) < at_once_s);
      REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
      CHECK(seconds_since(back) > 2);
    }
    CHECK(anna.said().find("work goes back to the controller") != std::string::npos);
    CHECK(ran({"jobs", "log", id, "--cluster", lab.cluster()}).out.find("failed") == std::string::npos);
    REQUIRE(lab.until([&] { return is_over(lab.job(id).value("state", "")); }));
    CHECK(lab.job(id)["state"] == "done");
    CHECK(std::abs(lab.job(id)["energy"]["residual"].get<double>()) < 1e-3);
  }

  TEST_CASE("idle: a node waits for its owner to leave, and runs behind everybody") {
    SmallLab lab;
    const Owner owner;
    owner.touch(-5);  // for five more seconds
    const auto start = Clock::now();
    Process& anna = lab.start("anna", owner.options());
    REQUIRE(anna.says("works while the owner has been away"));
    CHECK(::sched_getscheduler(anna.id()) == SCHED_IDLE);
    REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
    CHECK(seconds_since(start) > 6);
    std::size_t threads = 0, in_front = 0;
    for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(anna.id()) + "/task")) {
      const int tid = std::stoi(thread.path().filename().string());
      ++threads;
      in_front += ::sched_getscheduler(tid) != SCHED_IDLE || ::getpriority(PRIO_PROCESS, static_cast<id_t>(tid)) != 19;
    }
    CHECK(threads > 4);
    CHECK(in_front <= 1);  // what waits for signals was there before, and does nothing
    anna.signal(SIGTERM);
    const Outcome outcome = anna.finish();
    CHECK(outcome.status == 0);
    CHECK(outcome.seconds < 5);
  }

  TEST_CASE("idle: a node that is stopped in order is none that its job killed") {
    SmallLab lab;
    lab.start("anna");
    lab.start("bert");
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    const std::string id = lab.submit(200000);
    for (int stops = 0; stops < 4; ++stops) {
      CAPTURE(stops);
      REQUIRE(lab.until([&] { return lab.job(id).value("nodes", nlohmann::json::array()).size() == 2; }));
      lab.node("bert").signal(SIGTERM);
      CHECK(lab.node("bert").finish().status == 0);
      REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
      lab.start("bert");
      REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
      REQUIRE_FALSE(is_over(lab.job(id).value("state", "")));
    }
    lab.asked({"jobs", "cancel", id});
  }

  TEST_CASE("idle: its options need each other and make sense") {
    for (const SmallLab::Words& wrong : {SmallLab::Words{"--idle-after", "3"},
                                         {"--owner-files", "/dev/tty"},
                                         {"--idle-only", "--idle-after", "0"},
                                         {"--idle-only", "--idle-after", "soon"},
                                         {"--idle-only", "--idle-cores", "-1"}}) {
      SmallLab::Words words{"node", "--join", "127.0.0.1:1"};
      words.insert(words.end(), wrong.begin(), wrong.end());
      const Outcome outcome = ran(words);
      CHECK(outcome.status == 2);
      CHECK(outcome.complains("--"));
    }
  }
}
