#include "io/scene_bytes.hpp"

#include <doctest/doctest.h>

#include "io/scene_reader.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;

TEST_SUITE("io") {
  TEST_CASE("scene_bytes: a parcel reads back, and no damaged one does") {
    const test::ScratchFolder folder;
    const std::string path = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Expected<LoadedScene> loaded = read_scene(path);
    REQUIRE(loaded);
    const std::string parcel = scene_parcel(loaded->scene);
    const Expected<Scene> back = scene_from_parcel(parcel, "parcel");
    REQUIRE(back);
    CHECK(scene_parcel(*back) == parcel);
    for (std::size_t length = 0; length < parcel.size(); ++length)
      CHECK_FALSE(scene_from_parcel(std::string_view(parcel).substr(0, length), "parcel"));
    CHECK_FALSE(scene_from_parcel(parcel + "x", "parcel"));
    // A length beyond the end, as large as can be.
    std::string longer = parcel;
    for (std::size_t i = 16; i < 24; ++i) longer[i] = '\xff';
    test::check_error(scene_from_parcel(longer, "parcel"), "parcel", "cut off");
    test::check_error(scene_from_parcel("v 0 0 0\n", "parcel"), "parcel", "is no scene of lichthof");
  }
}
