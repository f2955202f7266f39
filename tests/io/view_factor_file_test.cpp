#include "io/view_factor_file.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

ViewFactors two_surfaces() {
  ViewFactors factors;
  factors.count = 2;
  factors.areas = {2, 0.5};
  factors.exchange = {0, 0.25, 0.25, 0.125};
  factors.errors = {0, 1e-7, 1e-7, 0};
  return factors;
}

const std::vector<std::string> names{"1:wall, white", "2:\"lamp\""};

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("view_factor_file: a CSV has names, areas and a row a surface") {
    const ScratchFolder folder;
    REQUIRE(write_view_factors(folder / "f.csv", two_surfaces(), names));
    CHECK(folder.read("f.csv") ==
          "surface,area_m2,\"1:wall, white\",\"2:\"\"lamp\"\"\"\n"
          "\"1:wall, white\",2,0,0.125\n"
          "\"2:\"\"lamp\"\"\",0.5,0.5,0.25\n");
  }

  TEST_CASE("view_factor_file: JSON has sums and errors, too") {
    const ScratchFolder folder;
    REQUIRE(write_view_factors(folder / "f.json", two_surfaces(), names));
    const nlohmann::json document = nlohmann::json::parse(folder.read("f.json"));
    CHECK(document["surfaces"][1]["name"] == names[1]);
    CHECK(document["surfaces"][1]["area_m2"] == 0.5);
    CHECK(document["surfaces"][1]["row_sum"] == 0.75);
    CHECK(document["factors"] == nlohmann::json::parse("[[0, 0.125], [0.5, 0.25]]"));
    CHECK(document["complete"] == true);
    CHECK(document["errors"] == nlohmann::json::parse("[[0, 5e-8], [2e-7, 0]]"));
  }

  TEST_CASE("view_factor_file: View3D's format has a header, areas, rows, emittances") {
    const ScratchFolder folder;
    REQUIRE(write_view_factors(folder / "f.vf", two_surfaces(), names, {1e-6, {}, {0.9, 0.25}}));
    CHECK(folder.read("f.vf") ==
          "View3D 3.2 0 0 0 2            \n2 0.5\n0.000000000 0.125000000\n0.500000000 0.250000000\n0.900 0.250\n");
  }

  TEST_CASE("view_factor_file: what is wrong with the figures stands in every format") {
    const ScratchFolder folder;
    ViewFactors f = two_surfaces();
    f.pairs_missing = 1, f.pairs_inexact = 2;
    f.exchange[1] = f.exchange[2] = f.errors[1] = f.errors[2] = std::nan("");
    f.errors[3] = 1e-3;
    const ViewFactorRecord record{1e-6, {}, {}};
    const std::vector<std::string> lines = faults(f, 1e-6, names);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0].find("incomplete: 1 pairs") == 0);
    CHECK(lines[1].find("0.002, from 2:\"lamp\"") != std::string::npos);
    for (const char* name : {"f.csv", "f.vf"}) {
      REQUIRE(write_view_factors(folder / name, f, names, record));
      CHECK(folder.read(name).find("# incomplete") != std::string::npos);
      CHECK(folder.read(name).find("# 2 pairs of surfaces missed the tolerance") != std::string::npos);
    }
    CHECK(folder.read("f.csv").find("white\",2,0,\n") != std::string::npos);
    CHECK(folder.read("f.vf").find("nan") != std::string::npos);
    REQUIRE(write_view_factors(folder / "f.json", f, names, record));
    const nlohmann::json document = nlohmann::json::parse(folder.read("f.json"));
    CHECK(document["complete"] == false);
    CHECK(document["pairs"]["missing"] == 1);
    CHECK(document["pairs"]["inexact"] == 2);
    CHECK(document["factors"][0][1].is_null());
  }

  TEST_CASE("view_factor_file: only the rows that were asked for") {
    const ScratchFolder folder;
    const ViewFactorRecord record{1e-6, {1}, {}};
    REQUIRE(write_view_factors(folder / "f.csv", two_surfaces(), names, record));
    CHECK(folder.read("f.csv") ==
          "surface,area_m2,\"1:wall, white\",\"2:\"\"lamp\"\"\"\n\"2:\"\"lamp\"\"\",0.5,0.5,0.25\n");
    REQUIRE(write_view_factors(folder / "f.json", two_surfaces(), names, record));
    const nlohmann::json document = nlohmann::json::parse(folder.read("f.json"));
    CHECK(document["columns"] == nlohmann::json(names));
    CHECK(document["factors"] == nlohmann::json::parse("[[0.5, 0.25]]"));
    CHECK(document["surfaces"].size() == 1);
  }

  TEST_CASE("view_factor_file: what can not be written is one clear line and leaves nothing") {
    const ScratchFolder folder;
    check_error(write_view_factors(folder / "no/f.csv", two_surfaces(), names), folder / "no/f.csv", "No such file");
    check_error(write_view_factors(folder / "f.txt", two_surfaces(), names), folder / "f.txt", ".vf, .csv or .json");
    check_error(write_view_factors("/dev/full", two_surfaces(), names), "/dev/full", ".vf, .csv or .json");
    CHECK(folder.names().empty());
  }
}
