#include "io/scene_file.hpp"

#include <doctest/doctest.h>

#include "io/scene_writer.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

const std::string part = "[[part]]\nfile = \"a.obj\"\n";

Expected<LoadedScene> read(const ScratchFolder& folder, const std::string& toml, const ReadOptions& options = {}) {
  folder.write("m.mtl", "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 1 1 1\n");
  folder.write("a.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl wall\nf 1 2 3 4\n");
  return read_scene(folder.write("s.toml", toml), options);
}

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("scene_file: parts are scaled, turned, then moved") {
    const ScratchFolder folder;
    const auto loaded =
        read(folder, "unit = \"cm\"\n" + part + "scale = 2\nrotate_z = 90\ntranslate = [10, 0, 5]\n" + part);
    REQUIRE(loaded);
    REQUIRE(loaded->scene.surfaces.size() == 2);
    CHECK(loaded->scene.materials.size() == 2);                // equal materials of both parts are one
    const Vec3 second = loaded->scene.surfaces[0].corners[1];  // was (1, 0, 0)
    CHECK(second.x == doctest::Approx(0.10));
    CHECK(second.y == doctest::Approx(0.02));
    CHECK(second.z == doctest::Approx(0.05));
    CHECK(loaded->scene.surfaces[1].source_face == 2);
  }

  TEST_CASE("scene_file: in a y-up file rotate_z turns about the vertical") {
    const ScratchFolder folder;
    const auto loaded = read(folder, "up = \"y\"\n" + part + "rotate_z = 90\n");
    REQUIRE(loaded);
    const Vec3 fourth = loaded->scene.surfaces[0].corners[3];  // was (0, 1, 0), which is up
    CHECK(fourth.z == doctest::Approx(1));
    CHECK(loaded->scene.surfaces[0].corners[1].y == doctest::Approx(1));
  }

  TEST_CASE("scene_file: cameras, patch size and material changes arrive in metres") {
    const ScratchFolder folder;
    const auto loaded =
        read(folder, "unit = \"mm\"\n[mesh]\npatch = 500\n" + part +
                         "[[camera]]\nname = \"a\"\neye = [1000, 0, 0]\ntarget = [0, 0, 0]\nfov = 45\n"
                         "[[material]]\nname = \"wall\"\nreflectance = [1.5, 0.5, 0]\nemission = [3, 2, 1]\n");
    REQUIRE(loaded);
    CHECK(*loaded->scene.patch_size == doctest::Approx(0.5));
    REQUIRE(loaded->scene.cameras.size() == 1);
    CHECK(loaded->scene.cameras[0].eye.x == doctest::Approx(1));
    CHECK(loaded->scene.cameras[0].up == Vec3{0, 0, 1});
    CHECK(loaded->scene.cameras[0].vertical_fov_deg == 45);
    CHECK(loaded->scene.materials[0].radiance == Rgb{3, 2, 1});
    CHECK(loaded->scene.materials[0].reflectance.x == doctest::Approx(0.999));
    CHECK(loaded->report.emitters == 1);
  }

  TEST_CASE("scene_file: the command line goes before the file") {
    const ScratchFolder folder;
    ReadOptions options;
    options.unit = "m";
    const auto loaded = read(folder, "unit = \"mm\"\n" + part, options);
    REQUIRE(loaded);
    CHECK(loaded->report.extent.x == doctest::Approx(1));
  }

  TEST_CASE("scene_file: what is wrong is one line with its number") {
    const ScratchFolder folder;
    const std::string file = folder / "s.toml";
    check_error(read(folder, "unit = \n"), file + ":1", "TOML");
    check_error(read(folder, ""), file, "no [[part]]");
    check_error(read(folder, part + "colour = 1\n"), file + ":3",
                "unknown key 'colour' in [[part]]; known are file, scale");
    check_error(read(folder, "lamps = 1\n" + part), file + ":1", "known are unit, up, mesh, part, camera, material");
    check_error(read(folder, "unit = \"yard\"\n" + part), file + ":1", "mm, cm, m, in or ft");
    check_error(read(folder, "up = 3\n" + part), file + ":1", "text in quotes");
    check_error(read(folder, part + "scale = 0\n"), file + ":3", "'scale' expects a number");
    check_error(read(folder, part + "scale = nan\n"), file + ":3", "'scale' expects a number");
    check_error(read(folder, part + "translate = [1, 2]\n"), file + ":3", "three numbers");
    check_error(read(folder, "[[part]]\nfile = \"b.obj\"\n"), file + ":2", "'b.obj' does not exist");
    check_error(read(folder, "[[part]]\nfile = \"b.stl\"\n"), file + ":2", "no OBJ file");
    check_error(read(folder, "[[part]]\nscale = 1\n"), file + ":1", "'file' is missing");
    check_error(read(folder, "[part]\nfile = \"a.obj\"\n"), file + ":1", "[[part]]");
    check_error(read(folder, part + "[mesh]\npatch = -1\n"), file + ":4", "'patch' expects a number");
    check_error(read(folder, part + "[[camera]]\nname = \"a\"\neye = [0, 0, 0]\n"), file + ":3", "'target' is missing");
    check_error(read(folder, part + "[[camera]]\nname = \"a\"\neye = [0, 0, 0]\ntarget = [0, 0, 0]\n"), file + ":3",
                "same point");
    check_error(read(folder, part + "[[camera]]\nname = \"a\"\neye = [0, 0, 0]\ntarget = [0, 0, 1]\n"), file + ":3",
                "up direction");
    check_error(read(folder, part + "[[material]]\nname = \"gold\"\n"), file + ":3", "no part has a material 'gold'");
    check_error(read(folder, part + "[[material]]\nname = \"wall\"\nemission = [-1, 0, 0]\n"), file + ":5",
                "'emission' expects");
  }

  TEST_CASE("scene_file: a patch size that would drown the machine is refused") {
    const ScratchFolder folder;
    check_error(read(folder, "[mesh]\npatch = 1e-7\n" + part), folder / "s.toml", "patch");
  }

  TEST_CASE("scene_writer: scenes come back as they were") {
    const ScratchFolder folder;
    auto loaded = read(folder, "[mesh]\npatch = 0.25\n" + part + "translate = [0.1, 0.2, 0.3]\nrotate_z = 30\n" +
                                   "[[camera]]\nname = \"my \\\"cam\\\"\"\neye = [1.1, 0, 0]\ntarget = [0, 0, 0]\n");
    REQUIRE(loaded);
    Scene& scene = loaded->scene;
    scene.materials[1].finish = Finish::glass;
    scene.materials[1].name = "wall";  // a name twice
    scene.textures.push_back({"t", 2, 1, {0.f, 0.25f, 1.f, 0.5f, 0.125f, 0.75f}});
    scene.materials[0].texture = 0;
    scene.surfaces[0].texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    REQUIRE(write_scene(folder / "out.toml", scene, scene.file_frame));
    const auto again = read_scene(folder / "out.toml");
    REQUIRE_MESSAGE(again, again.error().text());
    const Scene& copy = again->scene;
    REQUIRE(copy.surfaces.size() == 1);
    CHECK(copy.surfaces[0].corners == scene.surfaces[0].corners);
    CHECK(copy.surfaces[0].texcoords == scene.surfaces[0].texcoords);
    CHECK(copy.materials.size() == 2);
    CHECK(copy.materials[1].finish == Finish::glass);
    CHECK(copy.cameras[0].name == scene.cameras[0].name);
    CHECK(copy.cameras[0].eye == scene.cameras[0].eye);
    CHECK(*copy.patch_size == 0.25);
    REQUIRE(copy.textures.size() == 1);
    for (std::size_t i = 0; i < 6; ++i)
      CHECK(copy.textures[0].rgb[i] == doctest::Approx(scene.textures[0].rgb[i]).epsilon(1e-4));

    const FileFrame millimetres_y_up{0.001, true};
    REQUIRE(write_scene(folder / "other.obj", scene, millimetres_y_up));
    ReadOptions options;
    options.unit = "mm";
    options.up = "y";
    const auto other = read_scene(folder / "other.obj", options);
    REQUIRE(other);
    CHECK(glm::length(other->scene.surfaces[0].corners[2] - scene.surfaces[0].corners[2]) < 1e-12);
    check_error(write_scene(folder / "no/out.obj", scene, {}), folder / "no/out_texture1.png", "No such file");
    check_error(write_scene(folder / "out.gltf", scene, {}), folder / "out.gltf", ".obj and .toml");
  }
}
