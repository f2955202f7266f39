/// `lichthof viewfactors` from outside: figures with known answers, files, exit statuses.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <sstream>
#include <string>
#include <thread>
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

  TEST_CASE("viewfactors: a thin plate of two faces has two rows, and the room's rows sum to 1") {
    const Folder folder;
    folder.write("p.mtl", "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl down\nKd 0.5 0.5 0.5\nnewmtl up\nKd 0.5 0.5 0.5\n");
    const std::string scene =
        folder.write("p.obj",
                     "mtllib p.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                     "v .2 .2 .5\nv .8 .2 .5\nv .8 .8 .5\nv .2 .8 .5\nusemtl wall\n"
                     "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n"
                     "usemtl down\nf 12 11 10 9\nusemtl up\nf 9 10 11 12\n");
    const Outcome outcome = ran({"viewfactors", scene, "-o", folder / "f.json", "--json"});
    CHECK(outcome.status == 0);
    CHECK(outcome.err.find("warning") == std::string::npos);
    CHECK(outcome.json()["surfaces"] == 8);
    CHECK(outcome.json()["row_sums"]["largest_deviation"].get<double>() < 1e-5);
    const nlohmann::json matrix = nlohmann::json::parse(contents(folder / "f.json"));
    CHECK(matrix["surfaces"][6]["name"] == "7:down");
    CHECK(matrix["surfaces"][7]["name"] == "8:up");
    CHECK(matrix["factors"][6][0].get<double>() > 0.2);
    CHECK(matrix["factors"][7][0] == 0);
  }

  TEST_CASE("viewfactors: groups are rows, patterns choose rows and what only obstructs") {
    const Folder folder;
    folder.write("plates.mtl", "newmtl plate\nKd 0.5 0.5 0.5\n");
    const std::string scene = folder.write(
        "g.obj",
        "mtllib plates.mtl\nusemtl plate\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "v 0.25 0.25 0.5\nv 0.75 0.25 0.5\nv 0.75 0.75 0.5\nv 0.25 0.75 0.5\n"
        "o floor\nf 1 2 3\nf 1 3 4\no ceiling\nf 8 7 6 5\no baffle\nf 9 10 11 12\n");
    const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_square_between_plates(0.5);
    CHECK(ran({"viewfactors", scene, "--by", "group", "--obstruct-only", "baf*", "-o", folder / "g.csv"}).status == 0);
    auto rows = cells_of(folder / "g.csv");
    REQUIRE(rows.size() == 3);
    CHECK(rows[0] == std::vector<std::string>{"surface", "area_m2", "floor", "ceiling"});
    CHECK(std::abs(std::stod(rows[1][3]) - exact) < 3e-6);  // two triangles, each within its tolerance
    CHECK(ran({"viewfactors", scene, "--by", "group", "--rows", "ceil*", "-o", folder / "r.csv"}).status == 0);
    rows = cells_of(folder / "r.csv");
    REQUIRE(rows.size() == 2);
    CHECK(rows[1][0] == "ceiling");
    CHECK(std::abs(std::stod(rows[1][2]) - exact) < 3e-6);
    const Outcome none = ran({"viewfactors", scene, "--rows", "roof*"});
    CHECK(none.status == 2);
    CHECK(none.complains("--rows"));
  }

  TEST_CASE("viewfactors: View3D's files in, View3D's files out") {
    const Folder folder;
    const std::string scene = folder.write(
        "s.vs3",
        "T Two squares with a square between\nC encl=0 list=3\nF 3\n"
        "V 1 0. 0. 0.\nV 2 1. 0. 0.\nV 3 1. 1. 0.\nV 4 0. 1. 0.\nV 5 0. 0. 1.\nV 6 1. 0. 1.\nV 7 1. 1. 1.\nV 8 0. 1. "
        "1.\n"
        "V 9 .25 .25 .5\nV 10 .75 .25 .5\nV 11 .75 .75 .5\nV 12 .25 .75 .5\n"
        "S 1 1 2 3 4 0 0 0.90 low\nS 2 7 6 5 0 0 0 0.50 high\nS 3 5 8 7 0 0 2 0.50 rest\nO 4 9 10 11 12\nEnd\n");
    CHECK(ran({"viewfactors", scene, "-o", folder / "s.vf"}).status == 0);
    std::istringstream text(contents(folder / "s.vf"));
    std::string program, version, rest;
    int format = -1, enclosure = -1, emittances = -1, count = 0;
    text >> program >> version >> format >> enclosure >> emittances >> count;
    CHECK(program == "View3D");
    CHECK(format == 0);
    REQUIRE(count == 2);
    std::vector<double> numbers;
    for (double number = 0; text >> number;) numbers.push_back(number);
    REQUIRE(numbers.size() == 8);
    const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_square_between_plates(0.5);
    CHECK(numbers[0] == 1);
    CHECK(numbers[1] == 1);
    CHECK(numbers[2] == 0);
    CHECK(std::abs(numbers[3] - exact) < 3e-6);
    CHECK(numbers[6] == doctest::Approx(0.9));
    CHECK(numbers[7] == doctest::Approx(0.5));
  }

  TEST_CASE("viewfactors: when interrupted what was reached is written, and marked") {
    const Folder folder;
    std::ostringstream obj;
    folder.write("plates.mtl", "newmtl plate\nKd 0.5 0.5 0.5\n");
    obj << "mtllib plates.mtl\nusemtl plate\n";
    // Leaves turned every way, all between all others: hours at this tolerance.
    for (int k = 0; k < 400; ++k) {
      const double x = k % 8, y = k / 8 % 8, z = k / 64, t = 0.7 * k;
      const double c = 0.4 * std::cos(t), s = 0.4 * std::sin(t);
      obj << "v " << x << ' ' << y << ' ' << z << "\nv " << x + c << ' ' << y + s << ' ' << z + 0.2 << "\nv " << x - s
          << ' ' << y + c << ' ' << z + 0.5 << "\nf -3 -2 -1\n";
    }
    const std::string scene = folder.write("leaves.obj", obj.str());
    Process process(
        {"viewfactors", scene, "-o", folder / "f.json", "--sides", "both", "--tolerance", "1e-9", "--verbose"});
    REQUIRE(process.says("leaves.obj"));
    std::this_thread::sleep_for(std::chrono::seconds(1));
    process.signal(SIGINT);
    const Outcome outcome = process.finish();
    CHECK(outcome.status == 1);
    CHECK(outcome.seconds < 5);
    CHECK(outcome.err.find("incomplete: ") != std::string::npos);
    CHECK(outcome.err.find("interrupted; what was reached is kept in " + (folder / "f.json")) != std::string::npos);
    const nlohmann::json matrix = nlohmann::json::parse(contents(folder / "f.json"));
    CHECK(matrix["complete"] == false);
    CHECK(matrix["pairs"]["missing"].get<int>() > 0);
    CHECK(matrix["surfaces"].size() == 800);
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
    refused({scene, "-o", folder / "f.txt"}, ".vf, .csv or .json");
    refused({scene, "-o", scene}, ".vf, .csv or .json");
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
