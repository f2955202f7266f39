#include "io/view_factor_file.hpp"

#include <doctest/doctest.h>

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
    CHECK(document["errors"] == nlohmann::json::parse("[[0, 5e-8], [2e-7, 0]]"));
  }

  TEST_CASE("view_factor_file: what can not be written is one clear line and leaves nothing") {
    const ScratchFolder folder;
    check_error(write_view_factors(folder / "no/f.csv", two_surfaces(), names), folder / "no/f.csv", "No such file");
    check_error(write_view_factors(folder / "f.txt", two_surfaces(), names), folder / "f.txt", ".csv or .json");
    check_error(write_view_factors("/dev/full", two_surfaces(), names), "/dev/full", ".csv or .json");
    CHECK(folder.names().empty());
  }
}
