#include "io/vs3_reader.hpp"

#include <doctest/doctest.h>

#include "io/scene_reader.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

const std::string vertices =
    "T two squares and what stands between\nC encl=0 list=1\nF 3\n! # x y z\n"
    "V 1 0. 0. 0.\nV 2 1. 0. 0.\nV 3 1. 1. 0.\nV 4 0. 1. 0.\n"
    "V 5 0. 0. 1.\nV 6 1. 0. 1.\nV 7 1. 1. 1.\nV 8 0. 1. 1.\n"
    "v 9 .2 .2 .5\nv 10 .8 .2 .5\nv 11 .8 .8 .5\n";

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("vs3_reader: surfaces have their names, emittances, combinations; obstructions only obstruct") {
    const ScratchFolder folder;
    const std::string file = folder.write("s.vs3", vertices +
                                                       "S 1 1 2 3 4 0 0 0.90 floor\nS 2 7 6 5 0 0 0 0.50 half\n"
                                                       "S 3 7 5 8 0 0 2 0.50 other\nO 4 9 10 11 0\nEnd of data\nS 9\n");
    const auto loaded = read_scene(file);
    REQUIRE(loaded);
    const Scene& scene = loaded->scene;
    REQUIRE(scene.surfaces.size() == 4);
    CHECK(scene.material_of(scene.surfaces[0]).name == "floor");
    CHECK(scene.material_of(scene.surfaces[0]).reflectance.x == doctest::Approx(0.1));
    CHECK(scene.surfaces[0].normal == Vec3{0, 0, 1});
    CHECK(scene.surfaces[1].normal == Vec3{0, 0, -1});
    CHECK(loaded->origins[2].counts_to == 1);
    CHECK(loaded->origins[3].only_obstructs);
    CHECK_FALSE(loaded->origins[0].only_obstructs);
  }

  TEST_CASE("vs3_reader: what is wrong is named by its line") {
    const ScratchFolder folder;
    const auto read = [&](const std::string& lines) { return read_scene(folder.write("s.vs3", vertices + lines)); };
    check_error(read("S 1 1 2 3 99 0 0 .9 a\n"), folder / "s.vs3:16", "99 is not within 0 to 11");
    check_error(read("S 2 1 2 3 4 0 0 .9 a\n"), folder / "s.vs3:16", "in sequence");
    check_error(read("S 1 1 2 3 4 0 0\n"), folder / "s.vs3:16", "an emittance");
    check_error(read("S 1 1 2 3 4 0 1 .9 a\n"), folder / "s.vs3:16", "not within 0 to 0");
    check_error(read("M 1 1 2 3 4 0 0 .9 a\n"), folder / "s.vs3:16", "masks");
    check_error(read("F 2\n"), folder / "s.vs3:16", "F 3");
    check_error(read("V 12 0 0 nan\n"), folder / "s.vs3:16", "a coordinate");
    check_error(read("E\n"), folder / "s.vs3", "no surfaces");
  }
}
