/// `lichthof viewfactors` from outside: figures with known answers, files, exit statuses.
#include <doctest/doctest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/view_factor_references.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

/// Two unit plates that face each other, and a square half way between; no light anywhere.
std::string write_plates(const Folder& folder) {
  folder.write("plates.mtl", "newmtl plate\nKd 0.5 0.5 0.5\nnewmtl baffle\nKd 0.5 0.5 0.5\n");
  return folder.write("plates.obj",
                      "mtllib plates.mtl\n"
                      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                      "v 0.25 0.25 0.5\nv 0.75 0.25 0.5\nv 0.75 0.75 0.5\nv 0.25 0.75 0.5\n"
                      "usemtl plate\nf 1 2 3 4\nf 8 7 6 5\nusemtl baffle\nf 9 10 11 12\n");
}

std::vector<std::vector<std::string>> cells_of(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream text(contents(path));
  for (std::string line; std::getline(text, line);) {
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("viewfactors: plates with a baffle have their integral's figures, in CSV, JSON and report") {
    const Folder folder;
    const std::string scene = write_plates(folder);
    const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_square_between_plates(0.5);

    const Outcome csv = ran({"viewfactors", scene, "-o", folder / "f.csv"});
    CHECK(csv.status == 0);
    CHECK(csv.out.find("f.csv: 3 faces") != std::string::npos);
    CHECK(csv.out.find("row sums") != std::string::npos);
    CHECK(csv.out.find("reciprocity") != std::string::npos);
    const auto rows = cells_of(folder / "f.csv");
    REQUIRE(rows.size() == 4);
    CHECK(rows[0] == std::vector<std::string>{"surface", "area_m2", "1:plate", "2:plate", "3:baffle"});
    CHECK(rows[3][0] == "3:baffle");
    CHECK(std::stod(rows[3][1]) == 0.25);
    CHECK(std::abs(std::stod(rows[1][3]) - exact) < 1e-6);
    CHECK(std::abs(std::stod(rows[2][2]) - exact) < 1e-6);

    const Outcome json =
        ran({"viewfactors", scene, "-o", folder / "f.json", "--sides", "both", "--threads", "2", "--json"});
    CHECK(json.status == 0);
    const nlohmann::json report = json.json(), matrix = nlohmann::json::parse(contents(folder / "f.json"));
    CHECK(report["surfaces"] == 6);
    CHECK(report["pairs"]["obstructed"] == 1);
    CHECK(report["pairs"]["inexact"] == 0);
    CHECK(report["reciprocity"]["disagreeing"] == 0);
    CHECK(report["reciprocity"]["largest_defect"].get<double>() < 2e-6);
    CHECK(report["largest_error_estimate"].get<double>() <= 4e-6);  // of the plate a quarter as large
    CHECK(report["row_sums"]["least"] == 0);                        // the plates' backs
    CHECK(matrix["surfaces"][5]["name"] == "3:baffle:back");
    CHECK(std::abs(matrix["factors"][0][2].get<double>() - exact) < 1e-6);
    CHECK(matrix["errors"][0][2].get<double>() > 0);
  }

  TEST_CASE("viewfactors: a closed cube's rows sum to 1, by face and by material") {
    const Folder folder;
    write_furnace(folder, 0.5);
    const std::string scene = folder / "furnace.obj";
    const nlohmann::json faces = ran({"viewfactors", scene, "--json"}).json();
    CHECK(faces["surfaces"] == 6);
    CHECK(faces["output"].is_null());
    CHECK(faces["row_sums"]["largest_deviation"].get<double>() < 1e-9);
    const Outcome material = ran({"viewfactors", scene, "--by", "material", "-o", folder / "m.csv"});
    CHECK(material.status == 0);
    const auto rows = cells_of(folder / "m.csv");
    REQUIRE(rows.size() == 2);
    CHECK(std::stod(rows[1][1]) == doctest::Approx(6));
    CHECK(std::stod(rows[1][2]) == doctest::Approx(1).epsilon(1e-9));
  }

  TEST_CASE("viewfactors: bad usage and bad input are one line with status 2, and write nothing") {
    const Folder folder;
    const std::string scene = write_plates(folder);
    const auto refused = [&](std::vector<std::string> arguments, const std::string& complaint) {
      arguments.insert(arguments.begin(), "viewfactors");
      const Outcome outcome = ran(arguments);
      CHECK(outcome.status == 2);
      CHECK(outcome.out.empty());
      CHECK(outcome.complains(complaint));
    };
    refused({}, "SCENE");
    refused({folder / "none.obj"}, "none.obj");
    refused({scene, "-o", folder / "f.txt"}, ".csv or .json");
    refused({scene, "-o", scene}, ".csv or .json");
    refused({scene, "--tolerance", "0"}, "--tolerance");
    refused({scene, "--tolerance", "nan"}, "--tolerance");
    refused({scene, "--by", "colour"}, "--by");
    refused({scene, "--sides", "left"}, "--sides");
    refused({folder.write("empty.obj", "\n")}, "empty.obj");
    CHECK(folder.files() == std::vector<std::string>{"empty.obj", "plates.mtl", "plates.obj"});
    const Outcome missing = ran({"viewfactors", scene, "-o", folder / "no/f.csv"});
    CHECK(missing.status == 1);
    CHECK(missing.complains("no/f.csv"));
  }
}
