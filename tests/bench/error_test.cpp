#include "bench/error.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::bench;
using lichthof::test::Furnace;
using lichthof::test::PanelRoom;

namespace {

const std::atomic<bool> go_on = false;

ErrorOptions small_options() {
  ErrorOptions options;
  options.elements = {400, 800};
  options.growth = {400, 6400};
  options.points = 150;
  options.most_paths = 2048;
  return options;
}

bool beats(const ErrorRun& one, const ErrorRun& other) {
  return one.resolved && one.cpu_s <= other.cpu_s && one.error <= other.error &&
         (one.cpu_s < other.cpu_s || one.error < other.error);
}

ErrorRun plain_run(const char* method, double cpu_s, double irradiance) {
  ErrorRun run;
  run.method = method, run.cpu_s = cpu_s, run.irradiance = {Rgb{irradiance}};
  run.elements = run.method == "reference" ? 0 : 100;
  return run;
}

}  // namespace

TEST_SUITE("bench") {
  TEST_CASE("error: elements are doubled as long as the range holds them") {
    CHECK(ElementRange{1500, 6500}.doubled() == std::vector<std::uint32_t>{1500, 3000, 6000});
    CHECK(ElementRange{7, 7}.doubled() == std::vector<std::uint32_t>{7});
    CHECK(ElementRange{1u << 31, 0xffffffffu}.doubled().size() == 1);
  }

  TEST_CASE("error: errors lose the truth's part, and those below it are bounds") {
    ErrorReport report;
    report.scene = "0";
    report.truth.points.resize(1);
    report.truth.irradiance = {{Rgb{10}, Rgb{.3}}};
    report.runs = {plain_run("two-pass", 1, 10.5), plain_run("radiosity", .5, 9.9), plain_run("hemicube", 3, 9),
                   plain_run("reference", 16, 10.5)};
    judge(report);
    CHECK(report.truth_error == doctest::Approx(.03));
    CHECK(report.runs[0].error == doctest::Approx(.04));  // .05² - .03²
    CHECK(report.runs[0].resolved);
    CHECK(report.runs[0].on_frontier);
    CHECK(report.runs[0].ratio == doctest::Approx(16));
    CHECK_FALSE(report.runs[1].resolved);  // .01 measured
    CHECK(report.runs[1].error == doctest::Approx(.03));
    CHECK_FALSE(report.runs[1].on_frontier);
    CHECK(report.runs[1].ratio == 0);
    CHECK_FALSE(report.runs[2].on_frontier);
    CHECK(report.runs[2].ratio == doctest::Approx(16. / 3 * .0016 / (.01 - .0009)));
    CHECK(report.runs[3].ratio == 0);
    const nlohmann::json figures = json(error_section(std::vector<ErrorReport>{report}));
    CHECK(figures["scenes"]["0"]["ratio"] == report.runs[0].ratio);
    CHECK(figures["scenes"]["0"]["smallest_error"] == report.runs[0].error);
    CHECK(figures["goals"]["scenes/0/ratio"]["met"] == true);
  }

  TEST_CASE("error: uniform meshes are compared with refined ones between the best of them") {
    ErrorReport report;
    report.scene = "0";
    report.truth.points.resize(1);
    report.truth.irradiance = {{Rgb{10}, Rgb{0}}};
    const auto run = [](bool is_refined, std::uint32_t elements, double cpu_s, double error) {
      ErrorRun made = plain_run("radiosity", cpu_s, 10 * (1 + error));
      made.is_refined = is_refined, made.elements = elements;
      return made;
    };
    // Both reach .01, which lies half way, in powers, between .02 and .005. One of each is no better than a coarser one.
    report.runs = {run(false, 100, 1, .08),   run(false, 400, 2, .04),   run(false, 900, 3, .05),
                   run(false, 6400, 32, .01), run(true, 80, 1, .06),     run(true, 200, 2, .02),
                   run(true, 900, 9, .03),    run(true, 1200, 16, .005)};
    judge(report);
    REQUIRE(report.refinement);
    CHECK(report.refinement->error == doctest::Approx(.01));
    CHECK(report.refinement->elements == doctest::Approx(6400 / std::sqrt(200. * 1200)));
    CHECK(report.refinement->cpu == doctest::Approx(32 / std::sqrt(2. * 16)));
    const nlohmann::json figures = json(error_section(std::vector<ErrorReport>{report}));
    CHECK(figures["refinement"]["cpu"] == report.refinement->cpu);
    CHECK(figures["goals"]["refinement/elements"]["met"] == true);
    report.runs.resize(4);
    judge(report);
    CHECK_FALSE(report.refinement);
  }

  TEST_CASE("error: in a furnace every method of ours is exact, and path tracing errs as it says") {
    const Furnace furnace(1, .5);
    const BenchCase scene(furnace.scene, 1, go_on);
    Truth exact;
    exact.points = surface_points(*scene.mesh(), 100, 1);
    exact.irradiance.assign(exact.points.size(), {Rgb{furnace.total()}, Rgb{0}});
    ErrorOptions options = small_options();
    options.elements.most = options.elements.least, options.growth = options.elements;
    const auto report = error_report(scene, "furnace", options, exact, {});
    REQUIRE(report);
    CHECK(report->truth.paths == 0);
    std::set<std::string> methods;
    for (const ErrorRun& run : report->runs) {
      INFO(run.method, " ", run.rays);
      methods.insert(run.method);
      CHECK(run.cpu_s > 0);
      // What the threshold of the first pass leaves unshot; the item buffer has pixels instead of exact visibility, but
      // hides nothing in an empty cube.
      if (!run.is_reference()) CHECK(run.error < 2e-3);
      if (run.is_reference()) CHECK(run.error > 2e-3);
    }
    CHECK(methods == std::set<std::string>{"two-pass", "radiosity", "hemicube", "reference"});
    CHECK(report->growth.size() == 1);
    CHECK(report->growth_exponent == 0);
  }

  TEST_CASE("error: a lit room has its errors, frontier, ratios and growth") {
    const PanelRoom room(.5);
    const BenchCase scene(room.scene, 1, go_on);
    const ErrorOptions options = small_options();
    std::vector<std::string> shown;
    const auto report = error_report(scene, "room", options, {}, [&](const std::string& what, double share) {
      CHECK((share >= 0 && share <= 1));
      shown.push_back(what);
    });
    REQUIRE(report);
    CHECK_FALSE(shown.empty());
    REQUIRE(report->truth.irradiance.size() == options.points);
    CHECK(report->truth.paths <= options.most_paths);

    // The truth is finer than the smallest error, unless its paths were too few.
    double smallest = 1e300;
    for (const ErrorRun& run : report->runs) smallest = std::min(smallest, run.error);
    CHECK((report->truth.paths == options.most_paths || smallest >= 1.99 * report->truth_error));

    const ErrorRun* rough = nullptr;
    for (const ErrorRun& run : report->runs) {
      INFO(run.method, " ", run.elements, " ", run.rays);
      const bool is_beaten = std::any_of(report->runs.begin(), report->runs.end(),
                                         [&](const ErrorRun& other) { return beats(other, run); });
      if (run.on_frontier) CHECK_FALSE(is_beaten);
      if (run.resolved && !is_beaten) CHECK(run.on_frontier);
      CHECK((run.ratio > 0) == (run.resolved && !run.is_reference()));
      if (run.is_reference() && run.rays == 16) rough = &run;
    }
    REQUIRE(rough);
    // Path tracing of 16 paths errs by √(paths of the truth / 16) times the truth's standard error. 150 draws with heavy
    // tails: three times twice 1/√300.
    CHECK(rough->error == doctest::Approx(report->truth_error * std::sqrt(report->truth.paths / 16.)).epsilon(.35));

    REQUIRE(report->growth.size() == 3);
    CHECK(report->growth[2].elements > 10 * report->growth[0].elements);
    // The same shooters: what they receive, and so who shoots again, differs by the mesh's error.
    CHECK(report->growth[2].shots == doctest::Approx(report->growth[0].shots).epsilon(0.1));

    const std::vector<ErrorReport> reports{*report};
    const nlohmann::json figures = json(error_section(reports)), runs = runs_json(*report);
    CHECK(figures["growth"] == report->growth_exponent);
    CHECK(figures["scenes"]["room"]["ratio"].get<double>() >=
          figures["scenes"]["room"]["ratio_smallest"].get<double>());
    CHECK(figures["goals"].contains("scenes/room/ratio"));
    CHECK(std::ranges::count_if(report->runs, &ErrorRun::is_refined) == 4);
    REQUIRE(runs["runs"].size() == report->runs.size());
    CHECK(table(*report).size() == report->runs.size() + report->growth.size() + 3);

    // Every resolved run of two-pass is a mark in the plot; one more stands in the key, and growth has its own.
    std::size_t marks = 1 + report->growth.size() + 1, circles = 0;
    for (const ErrorRun& run : report->runs) marks += run.method == "two-pass" && run.resolved;
    const std::string drawing = plot(reports, "");
    for (std::size_t at = drawing.find("<circle"); at != std::string::npos; at = drawing.find("<circle", at + 1))
      ++circles;
    CHECK(circles == marks);
  }

  TEST_CASE("error: a set flag ends it") {
    const PanelRoom room(.5);
    const std::atomic<bool> stop = true;
    const auto report = error_report(BenchCase(room.scene, 1, stop), "room", small_options(), {}, {});
    REQUIRE_FALSE(report);
    CHECK(report.error().code == ErrorCode::interrupted);
  }
}
