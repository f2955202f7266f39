#include "io/points_file.hpp"

#include <doctest/doctest.h>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

TEST_SUITE("io") {
  TEST_CASE("points_file: rows come back verbatim with the results appended") {
    const ScratchFolder folder;
    const std::string rows = "name,x,y,z,nx,ny,nz\r\na, 1.50,2,3,0,0,2\r\n\r\nb,1e1,0,0,0,-1,0";
    const auto points = read_points(folder.write("p.csv", rows), {});
    REQUIRE(points);
    REQUIRE(points->positions.size() == 2);
    CHECK(points->positions[0] == Vec3{1.5, 2, 3});
    CHECK(points->normals[0] == Vec3{0, 0, 1});
    const std::vector<Rgb> irradiance{{1.0 / 3, 2, 3}, {0, 0, 1e-9}};
    REQUIRE(write_irradiance(folder / "o.csv", *points, irradiance));
    CHECK(folder.read("o.csv") ==
          "name,x,y,z,nx,ny,nz,Er,Eg,Eb\na, 1.50,2,3,0,0,2,0.333333333,2,3\nb,1e1,0,0,0,-1,0,0,0,1e-09\n");
    REQUIRE(write_illuminance(folder / "l.csv", *points, std::vector<Rgb>{Rgb{1}, Rgb{0}}));
    CHECK(folder.read("l.csv") == "name,x,y,z,nx,ny,nz,lux\na, 1.50,2,3,0,0,2,179\nb,1e1,0,0,0,-1,0,0\n");
  }

  TEST_CASE("points_file: positions are in the scene's unit and axes") {
    const ScratchFolder folder;
    const auto points = read_points(folder.write("p.csv", "x,y,z,nx,ny,nz\n1000,2000,0,0,1,0\n"), {0.001, true});
    REQUIRE(points);
    CHECK(points->positions[0].z == doctest::Approx(2));
    CHECK(points->normals[0] == Vec3{0, 0, 1});
  }

  TEST_CASE("points_file: what is wrong is one line with its number") {
    const ScratchFolder folder;
    const std::string file = folder / "p.csv", header = "x,y,z,nx,ny,nz\n";
    const auto read = [&folder](const std::string& text) { return read_points(folder.write("p.csv", text), {}); };
    check_error(read(""), file, "is empty");
    check_error(read("1,2,3,0,0,1\n"), file + ":1", "no column 'x'");
    check_error(read("x,y,z,nx,ny\n"), file + ":1", "no column 'nz'");
    check_error(read(header + "1,2,3,0,0,1\n1,2,3,0,0\n"), file + ":3", "has 5 cells");
    check_error(read(header + "1,2,3,0,0,0\n"), file + ":2", "normal has no length");
    check_error(read(header + "1,2,3,0,0,nan\n"), file + ":2", "nz is no number");
    check_error(read(header + "1,two,3,0,0,1\n"), file + ":2", "y is no number within 1e9: 'two'");
    check_error(read(header + "1,,3,0,0,1\n"), file + ":2", "y is no number");
    check_error(read_points(folder / "gone.csv", {}), folder / "gone.csv", "No such file");
    CHECK(read(header)->rows.empty());
  }

  TEST_CASE("points_file: estimates come back, in the scene's unit and axes") {
    const ScratchFolder folder;
    const FileFrame frame{0.001, true};
    const PointEstimates written{{{{1, 2, 3}, {0, 0, 1}}, {{4, 5, 6}, {0, -1, 0}}},
                                 {{{1.0 / 3, 2, 3}, {.1, .2, .3}}, {{0, 0, 0}, {0, 0, 0}}}};
    REQUIRE(write_estimates(folder / "e.csv", written, frame));
    const auto read = read_estimates(folder / "e.csv", frame);
    REQUIRE(read);
    REQUIRE(read->points.size() == 2);
    CHECK(glm::length(read->points[0].point - Vec3{1, 2, 3}) < 1e-8);  // nine digits
    CHECK(read->points[1].normal == Vec3{0, -1, 0});
    CHECK(read->irradiance[0].mean.x == doctest::Approx(1.0 / 3).epsilon(1e-8));
    CHECK(read->irradiance[0].standard_error.z == doctest::Approx(.3));
  }

  TEST_CASE("points_file: what probe writes is an estimate without error; what is no estimate is one line") {
    const ScratchFolder folder;
    const std::string file = folder / "p.csv", header = "x,y,z,nx,ny,nz,Er,Eg,Eb";
    const auto read = [&folder](const std::string& text) { return read_estimates(folder.write("p.csv", text), {}); };
    const auto probed = read(header + "\n1,2,3,0,0,1,4,5,6\n");
    REQUIRE(probed);
    CHECK(probed->irradiance[0].mean == Rgb{4, 5, 6});
    CHECK(probed->irradiance[0].standard_error == Rgb{0});
    check_error(read("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n"), file, "no columns Er,Eg,Eb");
    check_error(read(header + "\n"), file, "has no rows");
    check_error(read(header + "\n1,2,3,0,0,1,4,5,6\n1,2,3,0,0,1,4,nan,6\n"), file, "row 2");
    check_error(read(header + "\n1,2,3,0,0,1,4,5\n"), file, "row 1");
    check_error(read(header + ",Sr,Sg,Sb\n1,2,3,0,0,1,4,5,6,1,1,-1\n"), file, "numbers from 0");
  }

  TEST_CASE("points_file: an unwritable output is one clear line") {
    const ScratchFolder folder;
    const auto points = read_points(folder.write("p.csv", "x,y,z,nx,ny,nz\n1,2,3,0,0,1\n"), {});
    REQUIRE(points);
    check_error(write_irradiance(folder / "no/o.csv", *points, std::vector<Rgb>{Rgb{1}}), folder / "no/o.csv",
                "No such file");
    check_error(write_irradiance("/dev/full", *points, std::vector<Rgb>{Rgb{1}}), "/dev/full", "No space left");
  }
}
