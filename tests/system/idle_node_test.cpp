/// A node that works only while its machine's owner is away. The owner is the access time of a file, as he is that of his
/// terminals otherwise.
#include <fcntl.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/system/loopback_lab.hpp"

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
  LoopbackLab::Words options() const {
    return {"--idle-only", "--idle-after", "0.05", "--idle-cores", "0", "--owner-files", folder_ / "key*"};
  }

 private:
  Folder folder_;
  std::string keyboard_;
};

constexpr double at_once_s = 8;  // it looks twice a second; the rest is for a busy machine

bool is_hosted(LoopbackLab& lab, const std::string& id) {
  const nlohmann::json job = lab.job(id);
  return job.value("state", "") == "running" && !job["nodes"].empty();
}
bool is_over(const std::string& state) { return state == "done" || state == "failed" || state == "cancelled"; }

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("idle: a node yields when its owner comes back, as often as he does, and its job goes on") {
    LoopbackLab lab;
    const Owner owner;
    Process& anna = lab.start("anna", owner.options());
    REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
    const std::string id = lab.submit(80000);
    for (int yields = 0; yields < 4; ++yields) {  // one more than the nodes that a job may kill
      CAPTURE(yields);
      REQUIRE(lab.until([&] { return is_hosted(lab, id); }));
      if (yields == 3) {
        lab.start("bert");
        REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
      }
      const std::size_t others = yields == 3 ? 1 : 0;
      const auto back = Clock::now();
      owner.touch();
      REQUIRE(lab.until([&] { return lab.node_count() == others; }));
      CHECK(seconds_since(back) < at_once_s);
      REQUIRE(lab.until([&] { return lab.node_count() == others + 1; }));
      CHECK(seconds_since(back) > 2);
    }
    CHECK(anna.said().find("work goes back to the controller") != std::string::npos);
    // Behind everybody it might take its time, where others keep this machine busy.
    anna.signal(SIGTERM);
    CHECK(anna.finish().status == 0);
    REQUIRE(lab.until([&] { return is_over(lab.job(id).value("state", "")); }));
    CHECK(lab.job(id)["state"] == "done");
    // The order of shots moves the ledger by some 1e-4; a shot that was lost or counted twice would move it by more.
    const Folder folder;
    const double undisturbed =
        ran({"solve", std::string(LICHTHOF_SOURCE_DIR) + "/scenes/two_rooms.toml", "-o", folder / "rooms.lht",
             "--cells", "2", "--patch", "0.2", "--eps", "1e-5", "--json"})  // a lab takes the scene's own size
            .json()["energy"]["residual"];
    CHECK(std::abs(lab.job(id)["energy"]["residual"].get<double>() - undisturbed) < 1e-3);
  }

  TEST_CASE("idle: a node waits for its owner to leave, and runs behind everybody") {
    LoopbackLab lab;
    const Owner owner;
    owner.touch(-5);  // for five more seconds
    const auto start = Clock::now();
    Process& anna = lab.start("anna", owner.options());
    REQUIRE(anna.says("works while the owner has been away"));
    CHECK(::sched_getscheduler(anna.id()) == SCHED_IDLE);
    REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
    CHECK(seconds_since(start) > 6);
    std::size_t threads = 0;
    for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(anna.id()) + "/task")) {
      const int tid = std::stoi(thread.path().filename().string());
      ++threads;
      CHECK(::sched_getscheduler(tid) == SCHED_IDLE);
      CHECK(::getpriority(PRIO_PROCESS, static_cast<id_t>(tid)) == 19);
    }
    CHECK(threads > 4);
    anna.signal(SIGTERM);
    const Outcome outcome = anna.finish();
    CHECK(outcome.status == 0);
    CHECK(outcome.seconds < 5);
  }

  TEST_CASE("idle: a node that is stopped in order is none that its job killed") {
    LoopbackLab lab;
    std::string id;
    for (int stops = 0; stops < 4; ++stops) {
      CAPTURE(stops);
      Process& anna = lab.start("anna");
      if (id.empty()) id = lab.submit(80000);
      REQUIRE(lab.until([&] { return is_hosted(lab, id); }));
      anna.signal(SIGTERM);
      CHECK(anna.finish().status == 0);
      REQUIRE(lab.until([&] { return lab.node_count() == 0; }));
      CHECK(lab.job(id)["state"] == "queued");
    }
    // One that dies is; those lost within 3 s count as one.
    for (int deaths = 0; deaths < 3; ++deaths) {
      CAPTURE(deaths);
      std::this_thread::sleep_for(std::chrono::milliseconds(3500));
      Process& anna = lab.start("anna");
      REQUIRE(lab.until([&] { return is_hosted(lab, id); }));
      anna.signal(SIGKILL);
      anna.finish();
      REQUIRE(lab.until([&] { return lab.node_count() == 0; }));
      CHECK(lab.job(id)["state"] == (deaths == 2 ? "failed" : "queued"));
    }
  }

  TEST_CASE("idle: its options need each other and make sense") {
    for (const LoopbackLab::Words& wrong : {LoopbackLab::Words{"--idle-after", "3"},
                                            {"--owner-files", "/dev/tty"},
                                            {"--idle-only", "--idle-after", "0"},
                                            {"--idle-only", "--idle-after", "soon"},
                                            {"--idle-only", "--idle-cores", "-1"}}) {
      LoopbackLab::Words words{"node", "--join", "127.0.0.1:1"};
      words.insert(words.end(), wrong.begin(), wrong.end());
      const Outcome outcome = ran(words);
      CHECK(outcome.status == 2);
      CHECK(outcome.complains("--"));
    }
  }
}
