/// SIGINT and SIGTERM: the program ends within five seconds, and what was asked to be kept can be continued.
#include <doctest/doctest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <string>
#include <thread>

#include "core/light/solution.hpp"
#include "io/solution_file.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

constexpr double most_seconds = 5;

/// Far more work than any test waits for.
const std::vector<std::string> long_solve{"--elements", "20000", "--eps", "1e-9", "--verbose"};

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

void pause(int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("interruption: a solution is kept, and continued to the end of one that ran through") {
    const Folder folder;
    write_room(folder);
    const std::string kept = folder / "kept.lht";
    Process process(joined({"solve", folder / "room.obj", "-o", kept, "--cells", "2x1", "--json"}, long_solve));
    REQUIRE(process.says("first pass:"));
    pause(500);
    process.signal(SIGINT);
    const Outcome outcome = process.finish();
    MESSAGE("ended after " << outcome.seconds << " s");
    CHECK(outcome.seconds < most_seconds);
    CHECK(outcome.status == 1);
    CHECK(outcome.err.find("lichthof: interrupted") != std::string::npos);
    CHECK(outcome.json()["converged"] == false);

    const Expected<Solution> part = io::read_solution(kept);
    REQUIRE(part);
    CHECK_FALSE(part->converged);
    CHECK(part->counters.shots > 0);
    CHECK(std::abs(part->energy.residual()) < 0.05);
    const Outcome resumed = ran({"solve", kept, "-o", kept, "--eps", "1e-3", "--json"});
    CHECK(resumed.status == 0);
    CHECK(resumed.json()["converged"] == true);

    const Outcome straight = ran({"solve", folder / "room.obj", "-o", folder / "straight.lht", "--cells", "2x1",
                                  "--elements", "20000", "--eps", "1e-3"});
    CHECK(straight.status == 0);
    const Expected<Solution> a = io::read_solution(kept), b = io::read_solution(folder / "straight.lht");
    REQUIRE(a);
    REQUIRE(b);
    double difference = 0, whole = 0;
    for (std::size_t i = 0; i < a->irradiance.size(); ++i) {
      const Rgb x{a->irradiance[i] + a->pending[i]}, y{b->irradiance[i] + b->pending[i]};
      difference += glm::dot(x - y, x - y), whole += glm::dot(y, y);
    }
    INFO("relative RMS " << std::sqrt(difference / whole));
    // Both stop at the same threshold, but have not shot the same patches.
    CHECK(std::sqrt(difference / whole) < 0.03);
  }

  TEST_CASE("interruption: render keeps the solution that was asked for, and no half picture") {
    const Folder folder;
    write_room(folder);
    const std::vector<std::string> picture{"render",           folder / "room.obj", "-o",
                                           folder / "out.png", "--solution",        folder / "kept.lht"};
    Process solving(joined(picture, long_solve));
    REQUIRE(solving.says("first pass:"));
    pause(500);
    solving.signal(SIGTERM);
    const Outcome first = solving.finish();
    CHECK(first.seconds < most_seconds);
    CHECK(first.status == 1);
    CHECK(first.err.find("kept.lht") != std::string::npos);
    CHECK(io::read_solution(folder / "kept.lht"));

    Process tracing(joined(picture, {"--elements", "300", "--samples", "4096", "--size", "640x480", "--verbose"}));
    REQUIRE(tracing.says("second pass:"));
    pause(300);
    tracing.signal(SIGINT);
    const Outcome second = tracing.finish();
    CHECK(second.seconds < most_seconds);
    CHECK(second.status == 1);
    CHECK(second.err.find("lichthof: interrupted") != std::string::npos);
    CHECK(io::read_solution(folder / "kept.lht"));
    CHECK(folder.files() == std::vector<std::string>{"kept.lht", "room.mtl", "room.obj", "room.toml"});
  }

  TEST_CASE("interruption: where nothing is to be kept, the first signal is enough") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    Process process({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv", "--method",
                     "reference", "--samples", "10000000", "--verbose"});
    // Signals that come before main() end it as they end any program.
    REQUIRE(process.says("extent"));
    pause(200);
    process.signal(SIGTERM);
    const Outcome outcome = process.finish();
    CHECK(outcome.seconds < most_seconds);
    CHECK(outcome.status == 1);
    CHECK(outcome.err.ends_with("lichthof: interrupted\n"));
    CHECK_FALSE(folder.has("out.csv"));
  }
}
