/// Light as the program delivers it: closed forms, and the same bits however the work is divided.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include "io/image_writer.hpp"
#include "io/solution_file.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

// Room of 1500 elements: what single precision and hemicube pixels leave open in the ledger. Clusters of receivers that are
// cut off count here too.
constexpr double most_residual = 0.03;

/// RMS of the differences over RMS of the second list.
double relative_difference(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b) {
  REQUIRE(a.size() == b.size());
  double difference = 0, whole = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t c = 0; c < b[i].size(); ++c)
      difference += std::pow(a[i][c] - b[i][c], 2), whole += std::pow(b[i][c], 2);
  return std::sqrt(difference / whole);
}

/// Largest relative deviation from pi / (1 - 0.9) of the irradiance in a closed cube with Ke 1 and reflectance 0.9.
double furnace_deviation(const std::string& cells, const std::string& elements) {
  const Folder folder;
  write_furnace(folder, 0.9);
  const std::string points = folder.write("points.csv", cube_points());
  const Outcome outcome = ran({"probe", folder / "furnace.obj", "--points", points, "-o", folder / "out.csv", "--cells",
                               cells, "--elements", elements, "--json"});
  REQUIRE(outcome.status == 0);
  CHECK(std::abs(outcome.json()["energy"]["residual"].get<double>()) < 1e-4);
  MESSAGE(cells << " cells, " << outcome.json()["elements"] << " elements: " << outcome.json()["shots"] << " shots");
  double worst = 0;
  for (const auto& row : results_of(folder / "out.csv"))
    for (const double value : row) worst = std::max(worst, std::abs(value / (10 * std::numbers::pi) - 1));
  return worst;
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("light: a furnace of reflectance 0.9 is uniform within 1e-4, in one cell") {
    const double deviation = furnace_deviation("1", "6000");
    MESSAGE("largest deviation " << deviation);
    CHECK(deviation < 1e-4);
  }

  TEST_CASE("light: a furnace of reflectance 0.9 is uniform within 1e-4, in 2x2 cells") {
    const double deviation = furnace_deviation("2x2", "600");
    MESSAGE("largest deviation " << deviation);
    CHECK(deviation < 1e-4);
  }

  TEST_CASE("§5: the courtyard has 12 light sources and about 145 588 patches") {
    const Folder folder;
    const std::string writer = std::string(LICHTHOF_SOURCE_DIR) + "/scenes/courtyard.py";
    REQUIRE(std::system(("PYTHONDONTWRITEBYTECODE=1 python3 " + writer + " " + (folder / "court") + " > /dev/null").c_str()) == 0);
    // The mesh is what counts here: at eps 1 hardly anything is shot.
    const Outcome outcome = ran({"solve", folder / "court/courtyard.toml", "-o", folder / "court.lht", "--eps", "1", "--json"});
    REQUIRE(outcome.status == 0);
    CHECK(outcome.json()["patches"].get<double>() == doctest::Approx(145588).epsilon(0.01));
    CHECK(outcome.json()["import"]["emitters"] == 12);
  }

  TEST_CASE("light: one cell and four give the same irradiance") {
    const Folder folder;
    write_room(folder);
    const std::string points = folder.write("points.csv", room_points());
    for (const std::string cells : {"1", "2x2"}) {
      const Outcome outcome = ran({"probe", folder / "room.obj", "--points", points, "-o", folder / (cells + ".csv"),
                                   "--cells", cells, "--elements", "3000", "--json"});
      CHECK(outcome.status == 0);
      const nlohmann::json energy = outcome.json()["energy"];
      MESSAGE(cells << " cells: residual " << energy["residual"].get<double>());
      CHECK(std::abs(energy["residual"].get<double>()) < most_residual);
      CHECK(std::abs(energy["escaped"].get<double>()) < 1e-3 * energy["emitted"].get<double>());
    }
    const double difference = relative_difference(results_of(folder / "2x2.csv"), results_of(folder / "1.csv"));
    MESSAGE("relative difference " << difference);
    CHECK(difference < 0.015);
  }

  TEST_CASE("light: solution and picture have the same bits for any number of threads and any scheduling") {
    const Folder folder;
    write_room(folder);
    const auto render = [&](const std::string& name, const std::vector<std::string>& extra) {
      std::vector<std::string> arguments{"render",     folder / "room.toml",
                                         "-o",         folder / (name + ".exr"),
                                         "--solution", folder / (name + ".lht"),
                                         "--size",     "48x36",
                                         "--elements", "1200",
                                         "--cells",    "2x1"};
      arguments.insert(arguments.end(), extra.begin(), extra.end());
      const Outcome outcome = ran(arguments);
      INFO(outcome.err);
      REQUIRE(outcome.status == 0);
    };
    render("one", {"--threads", "1"});
    render("two", {"--threads", "2"});
    render("boxes", {"--threads", "3", "--balance", "boxes"});
    const Expected<io::Image> one = io::read_image(folder / "one.exr");
    const Expected<Solution> solved_by_one = io::read_solution(folder / "one.lht");
    REQUIRE(one);
    REQUIRE(solved_by_one);
    for (const std::string name : {"two", "boxes"}) {
      INFO(name);
      const Expected<io::Image> other = io::read_image(folder / (name + ".exr"));
      REQUIRE(other);
      CHECK(one->rgb == other->rgb);
      const Expected<Solution> solved = io::read_solution(folder / (name + ".lht"));
      REQUIRE(solved);
      CHECK(solved->irradiance == solved_by_one->irradiance);
      CHECK(solved->shot == solved_by_one->shot);
    }
  }
}
