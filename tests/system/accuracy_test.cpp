/// `--error` and `--check` from outside: the error that is told is the error that is there.
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

TEST_SUITE("system") {
  TEST_CASE("probe: --error is met, and says by which rounds") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    for (const double wanted : {0.1, 0.03}) {
      const Outcome outcome = ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv",
                                   "--error", std::to_string(wanted), "--json"});
      REQUIRE(outcome.status == 0);
      const nlohmann::json report = outcome.json(), &error = report["error"];
      CHECK(report["error_estimate"].get<double>() <= wanted);
      CHECK(error["met"] == true);
      CHECK(error["low"].get<double>() <= error["estimate"].get<double>());
      CHECK(error["high"].get<double>() <= wanted);
      REQUIRE(!error["rounds"].empty());
      CHECK(error["rounds"].back()["elements"] == report["elements"]);
      for (const char* part : {"visibility", "reconstruction", "discretisation", "convergence"})
        CHECK(error["parts"][part].get<double>() <= wanted);
    }
  }

  TEST_CASE("solve, render: --error and --check know what they make, and its solution agrees") {
    const Folder folder;
    write_room(folder);
    const Outcome solved = ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--error", "0.1", "--json"});
    REQUIRE(solved.status == 0);
    CHECK(solved.json()["error"]["met"] == true);
    const double estimate = solved.json()["error_estimate"];
    CHECK(estimate <= 0.1);
    // The solution by itself, checked at other points: two estimates from 256 and 256 points.
    const Outcome checked = ran({"solve", folder / "room.lht", "-o", folder / "again.lht", "--check", "--json"});
    REQUIRE(checked.status == 0);
    CHECK(checked.json()["error_estimate"].get<double>() == doctest::Approx(estimate).epsilon(0.5));
    const Outcome drawn =
        ran({"render", folder / "room.obj", "-o", folder / "room.exr", "--size", "40x30", "--error", "0.1"});
    CHECK(drawn.status == 0);
    CHECK(drawn.out.find("error ") != std::string::npos);
  }

  TEST_CASE("probe: an error that can not be met is said, with the reason, and the light is there all the same") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    const Outcome outcome = ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv", "--error",
                                 "0.002", "--elements", "500", "--gather", "16", "--eps", "0.01", "--json"});
    CHECK(outcome.status == 0);
    CHECK(outcome.json()["error"]["met"] == false);
    CHECK(outcome.json()["error"]["reason"].get<std::string>().find("nothing more can be turned") != std::string::npos);
    CHECK(outcome.complains("an error of 0.2 % was asked for"));
    CHECK(results_of(folder / "out.csv").size() > 10);
  }

  TEST_CASE("--strict: an error that is not reached is a failure, and what there is has been written") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    const std::vector<std::string> command{
        "probe", folder / "room.obj", "--points", points,     "-o",     folder / "out.csv", "--elements",
        "500",   "--gather",          "16",       "--strict", "--error"};
    const auto with = [&](const std::string& wanted) {
      std::vector<std::string> all = command;
      all.push_back(wanted);
      return ran(all);
    };
    CHECK(with("0.9").status == 0);
    const Outcome missed = with("0.002");
    CHECK(missed.status == 1);
    CHECK(missed.err.find("an error of 0.2 % was asked for") != std::string::npos);
    CHECK(missed.err.find("--strict") != std::string::npos);
    CHECK(results_of(folder / "out.csv").size() > 10);
  }

  TEST_CASE("solve, probe: a ledger that does not close is a warning that names the lamp") {
    // A lamp of half a metre shines on the ceiling 2 cm above it.
    const Folder folder;
    folder.write("room.mtl", "newmtl wall\nKd .6 .6 .6\nnewmtl lamp\nKe 100 100 100\n");
    folder.write("room.obj",
                 "mtllib room.mtl\n"
                 "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 2.5\nv 4 0 2.5\nv 4 3 2.5\nv 0 3 2.5\n"
                 "v 2 1 2.48\nv 2.5 1 2.48\nv 2.5 1.5 2.48\nv 2 1.5 2.48\n"
                 "usemtl wall\nf 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n"
                 "usemtl lamp\nf 9 10 11 12\n");
    const Outcome outcome =
        ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--elements", "500", "--json"});
    CHECK(outcome.status == 0);
    const double residual = outcome.json()["energy"]["residual"];
    const bool is_warned = outcome.err.find("does not add up") != std::string::npos;
    CHECK(is_warned == (residual < -0.01 || residual > 0.03));
    if (is_warned) CHECK(outcome.err.find("a lamp of 0.5 m shines on a surface 0.02 m away") != std::string::npos);
  }

  TEST_CASE("--error: refused where there is no first pass, and where its mesh is made already") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    const Outcome reference = ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv",
                                   "--error", "0.1", "--method", "reference"});
    CHECK(reference.status == 2);
    CHECK(reference.complains("--error"));
    CHECK(ran({"render", folder / "room.obj", "-o", folder / "x.exr", "--check", "--method", "raytrace"}).status == 2);
    CHECK(ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv", "--error", "nan"}).status ==
          2);
    CHECK(ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv", "--error", "0"}).status ==
          2);
    REQUIRE(ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--elements", "500"}).status == 0);
    const Outcome again = ran({"solve", folder / "room.lht", "-o", folder / "room.lht", "--error", "0.1"});
    CHECK(again.status == 2);
    CHECK(again.complains("solve the scene anew"));
  }
}
