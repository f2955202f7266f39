#include "io/scene_reader.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "core/scene/polygon.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

const std::string grey = "newmtl grey\nKd 0.5 0.5 0.5\n";
const std::string lamp = "newmtl lamp\nKd 0 0 0\nKe 2 1 0.5\n";
const std::string square = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl grey\n";

/// Reads an OBJ text whose material file is `mtl`.
Expected<LoadedScene> read(const ScratchFolder& folder, const std::string& obj, const std::string& mtl = grey + lamp,
                           const ReadOptions& options = {}) {
  folder.write("m.mtl", mtl);
  return read_scene(folder.write("s.obj", obj), options);
}

bool has_warning(const ImportReport& report, const std::string& part) {
  for (const std::string& line : report.text())
    if (line.find("warning: ") == 0 && line.find(part) != std::string::npos) return true;
  return false;
}

double total_area(const Scene& scene) {
  double sum = 0;
  for (const Surface& surface : scene.surfaces) sum += surface.area;
  return sum;
}

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("obj_reader: a square becomes one surface with its front up") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "f 1 2 3 4\n");
    REQUIRE(loaded);
    REQUIRE(loaded->scene.surfaces.size() == 1);
    const Surface& surface = loaded->scene.surfaces[0];
    CHECK(surface.area == doctest::Approx(1));
    CHECK(surface.normal == Vec3{0, 0, 1});
    CHECK(surface.source_face == 1);
    CHECK(loaded->scene.material_of(surface).reflectance == Rgb{0.5});
    CHECK(loaded->report.emitters == 0);
    CHECK(loaded->report.unused_materials == std::vector<std::string>{"lamp"});
    CHECK(loaded->report.open_edges == 4);
  }

  TEST_CASE("obj_reader: indices may count back, carry textures and normals, and continue over lines") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "vt 0 0\nvt 1 1\nvn 0 0 1\nf -4/1/1 -3/2 \\\n -2//-1 4/-1/1 # last\n");
    REQUIRE(loaded);
    CHECK(loaded->scene.surfaces[0].corners.size() == 4);
    CHECK(loaded->scene.surfaces[0].texcoords.empty());  // one corner has none
  }

  TEST_CASE("obj_reader: faces know the last object or group above them") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "f 1 2 3\no house\nf 1 2 4\ng east wing\nf 2 3 4\no house\nf 1 3 4\n");
    REQUIRE(loaded);
    CHECK(loaded->groups == std::vector<std::string>{"house", "east wing"});
    REQUIRE(loaded->origins.size() == 4);
    CHECK(loaded->origins[0].group == FaceList::Origin::none);
    CHECK(loaded->origins[1].group == 0);
    CHECK(loaded->origins[2].group == 1);
    CHECK(loaded->origins[3].group == 0);
  }

  TEST_CASE("face_list: two faces back to back stay where backs are kept, in one piece or in several") {
    const ScratchFolder folder;
    ReadOptions options;
    options.keep_backs = true;
    for (const char* back : {"f 4 3 2 1\n", "f 3 2 1\nf 4 3 1\n"}) {
      const auto kept = read(folder, square + "f 1 2 3 4\n" + back, grey, options);
      REQUIRE(kept);
      CHECK(total_area(kept->scene) == doctest::Approx(2));
      CHECK(kept->report.duplicates_dropped + kept->report.coplanar_overlaps == 0);
      CHECK(total_area(read(folder, square + "f 1 2 3 4\n" + back, grey)->scene) == doctest::Approx(1).epsilon(1e-6));
    }
    // The same way round they are one.
    CHECK(total_area(read(folder, square + "f 1 2 3 4\nf 2 3 4 1\n", grey, options)->scene) == doctest::Approx(1));
  }

  TEST_CASE("obj_reader: unit and up axis become metres and z up") {
    const ScratchFolder folder;
    ReadOptions options;
    options.unit = "mm";
    options.up = "y";
    const auto loaded =
        read(folder, "mtllib m.mtl\nv 0 0 0\nv 1000 0 0\nv 0 2000 0\nusemtl lamp\nf 1 2 3\n", grey + lamp, options);
    REQUIRE(loaded);
    const Surface& surface = loaded->scene.surfaces[0];
    CHECK(surface.corners[2].z == doctest::Approx(2));
    CHECK(surface.normal.y == doctest::Approx(-1));
    CHECK(surface.area == doctest::Approx(1));
    CHECK(loaded->scene.file_frame.metres_per_unit == 0.001);
    CHECK(loaded->report.power_w.x == doctest::Approx(2 * std::numbers::pi));
    CHECK(loaded->report.lumens == doctest::Approx(179 * std::numbers::pi * (0.2126 * 2 + 0.7152 + 0.0722 * 0.5)));
    options.unit = "yard";
    check_error(read(folder, square + "f 1 2 3\n", grey, options), "--unit", "mm, cm, m, in or ft");
  }

  TEST_CASE("obj_reader: concave and bent faces become convex planar pieces of the same area") {
    const ScratchFolder folder;
    const auto concave = read(
        folder, "mtllib m.mtl\nusemtl grey\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n");
    REQUIRE(concave);
    CHECK(concave->report.concave_split == 1);
    CHECK(concave->scene.surfaces.size() == 2);
    CHECK(total_area(concave->scene) == doctest::Approx(3));
    const auto bent = read(folder, "mtllib m.mtl\nusemtl grey\nv 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\nf 1 2 3 4\n");
    REQUIRE(bent);
    CHECK(bent->report.nonplanar_split == 1);
    CHECK(bent->scene.surfaces.size() == 2);
    for (const Surface& surface : bent->scene.surfaces) {
      CHECK(surface.corners.size() == 3);
      CHECK(surface.source_face == 1);
    }
    // A frame around a hole, joined by a bridge.
    const auto frame =
        read(folder,
             "mtllib m.mtl\nusemtl grey\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\n"
             "f 1 2 3 4 1 5 6 7 8 5\n");
    REQUIRE(frame);
    CHECK(total_area(frame->scene) == doctest::Approx(12));
    for (const Surface& surface : frame->scene.surfaces) CHECK(is_convex(surface.corners));
  }

  TEST_CASE("obj_reader: zero-area, crossing and duplicate faces are dropped and named") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "v 0.5 0 0\nv 3 0 0\nv 5 2 0\nv 5 0 0\nv 3 1 0\n" +
                                         "f 1 2 3 4\nf 1 5 2\nf 1 1 2\nf 2 3 4 1\nf 4 3 2 1\nf 6 7 8 9\n");
    REQUIRE(loaded);
    CHECK(loaded->report.faces_read == 6);
    CHECK(loaded->report.degenerate_dropped == 2);
    CHECK(loaded->report.duplicates_dropped == 2);
    CHECK(loaded->report.crossing_dropped == 1);
    CHECK(loaded->scene.surfaces.size() == 1);
    CHECK(has_warning(loaded->report, "s.obj:13: the face has no area"));
    CHECK(has_warning(loaded->report, "s.obj:15: the face has the corners of the one in"));
    check_error(read(folder, square + "f 1 2 1\n"), folder / "s.obj", "no face with an area");
  }

  TEST_CASE("obj_reader: of two faces in one place the one that emits is kept") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "f 1 2 3 4\nusemtl lamp\nf 4 3 2 1\n");
    REQUIRE(loaded);
    CHECK(loaded->scene.surfaces.size() == 1);
    CHECK(loaded->report.emitters == 1);
    CHECK(loaded->scene.surfaces[0].normal.z == doctest::Approx(-1));
  }

  TEST_CASE("obj_reader: a luminaire inside the plane of a ceiling is named, and the ceiling cut") {
    const ScratchFolder folder;
    const std::string lines = square + "v 0.4 0.4 0\nv 0.6 0.4 0\nv 0.6 0.6 0\nv 0.4 0.6 0\nv 1 0 1\nv 1 1 1\n" +
                              "f 1 2 3 4\nf 2 9 10 3\nusemtl lamp\nf 5 6 7 8\n";
    const auto loaded = read(folder, lines);
    REQUIRE(loaded);
    CHECK(loaded->report.coplanar_overlaps == 1);
    CHECK(has_warning(loaded->report, "s.obj:16: the luminaire lies in the plane of the one in"));
    // Neighbours that share an edge do not overlap.
    const auto neighbours = read(folder, square + "v 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n");
    REQUIRE(neighbours);
    CHECK(neighbours->report.coplanar_overlaps == 0);
    CHECK(neighbours->report.open_edges == 6);
  }

  TEST_CASE("obj_reader: a scene hundreds of metres across asks for its unit") {
    const ScratchFolder folder;
    const auto loaded = read(folder, "mtllib m.mtl\nusemtl grey\nv 0 0 0\nv 559 0 0\nv 0 500 0\nf 1 2 3\n");
    REQUIRE(loaded);
    CHECK(has_warning(loaded->report, "is its unit mm or cm?"));
    CHECK(loaded->report.json()["warnings"].size() == 1);
    CHECK(loaded->report.json()["faces_read"] == 1);
  }

  TEST_CASE("obj_reader: what is wrong in an OBJ file is one line with its number") {
    const ScratchFolder folder;
    const std::string file = folder / "s.obj";
    check_error(read(folder, ""), file, "no faces");
    check_error(read(folder, "# nothing\nv 0 0 0\n"), file, "no faces");
    check_error(read(folder, "hello world\n"), file + ":1", "is not an OBJ file");
    check_error(read(folder, square + "v nan 0 0\nf 1 2 3\n"), file + ":7", "not finite");
    check_error(read(folder, square + "v 0 inf 0\nf 1 2 3\n"), file + ":7", "not finite");
    check_error(read(folder, square + "v 1e400 0 0\nf 1 2 3\n"), file + ":7", "not finite");
    check_error(read(folder, square + "v 0 0\nf 1 2 3\n"), file + ":7", "expects 3 numbers, found 2");
    check_error(read(folder, square + "v 0 zero 0\nf 1 2 3\n"), file + ":7", "found 'zero'");
    check_error(read(folder, square + "f 1 2 99\nf 1 2 3\n"), file + ":7",
                "vertex index 99 is out of range: the file has 4");
    check_error(read(folder, square + "f 1 2 -5\n"), file + ":7", "counts back beyond the first");
    check_error(read(folder, square + "f 0 1 2\n"), file + ":7", "indices count from 1");
    check_error(read(folder, square + "f 1/9 2/1 3/1\nvt 0 0\n"), file + ":7", "texture coordinate index 9");
    check_error(read(folder, square + "f 1//9 2 3\n"), file + ":7", "normal index 9");
    check_error(read(folder, square + "f 1 2\n"), file + ":7", "at least 3 corners, found 2");
    check_error(read(folder, square + "f 1 2 x\n"), file + ":7", "found 'x'");
    check_error(read(folder, square + "f 1/1/1/1 2 3\n"), file + ":7", "slashes");
    check_error(read(folder, square + "f 99999999999999999999 2 3\n"), file + ":7", "vertex index");
    check_error(read(folder, square + "f 1 2 4294967297\n"), file + ":7", "out of range");
    check_error(read(folder, std::string("v 0 0 0\0", 8)), file, "not a text file");
    check_error(read_scene(folder / "missing.obj"), folder / "missing.obj", "No such file");
    check_error(read_scene(folder / ""), folder / "", "unknown kind of scene");
    check_error(read_scene(folder.write("s.fbx", "")), folder / "s.fbx", ".obj or .toml");
  }

  TEST_CASE("obj_reader: what is wrong with materials is one line with its number") {
    const ScratchFolder folder;
    const std::string obj = folder / "s.obj", mtl = folder / "m.mtl";
    check_error(read(folder, "mtllib other.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), obj + ":1",
                "'other.mtl' does not exist");
    check_error(read(folder, square + "usemtl gold\nf 1 2 3\n"), obj + ":7", "material 'gold' is not defined");
    check_error(read(folder, "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gold\nf 1 2 3\n"), obj + ":4",
                "no material file (mtllib)");
    const std::string face = square + "f 1 2 3\n";
    check_error(read(folder, face, "newmtl grey\nKd -0.1 0 0\n"), mtl + ":2", "Kd is negative");
    check_error(read(folder, face, "newmtl grey\nKd nan 0 0\n"), mtl + ":2", "Kd is not a finite number");
    check_error(read(folder, face, "newmtl grey\nKe 1 inf 0\n"), mtl + ":2", "Ke is not a finite number");
    check_error(read(folder, face, "newmtl grey\nKe 1 -1 0\n"), mtl + ":2", "Ke is negative");
    check_error(read(folder, face, "newmtl grey\nKd red\n"), mtl + ":2", "found 'red'");
    check_error(read(folder, face, "newmtl grey\nKd 1 1\n"), mtl + ":2", "three numbers");
    check_error(read(folder, face, "newmtl grey\nNs many\n"), mtl + ":2", "Ns expects a number");
    check_error(read(folder, face, "Kd 1 1 1\n"), mtl + ":1", "before the first newmtl");
    check_error(read(folder, face, "newmtl grey\nmap_Kd gone.png\n"), mtl + ":2", "texture 'gone.png'");
    folder.write("bad.png", "this is no picture");
    check_error(read(folder, face, "newmtl grey\nmap_Kd bad.png\n"), mtl + ":2", "cannot be read as an image");
    // Names nobody's face uses may stay undefined.
    CHECK(read(folder, "mtllib m.mtl\nusemtl gold\nusemtl grey\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  }

  TEST_CASE("obj_reader: a Kd of 1.2 is scaled below one with a warning that names material and line") {
    const ScratchFolder folder;
    const auto loaded = read(folder, square + "f 1 2 3\n", "newmtl grey\nKd 1.2 0.6 0\n");
    REQUIRE(loaded);
    const Rgb reflectance = loaded->scene.materials[0].reflectance;
    CHECK(reflectance.x == doctest::Approx(0.999));
    CHECK(reflectance.y == doctest::Approx(0.4995));
    CHECK(has_warning(loaded->report, "m.mtl:2: material 'grey' reflects 1.2 of the light"));
    const auto both = read(folder, square + "f 1 2 3\n", "newmtl grey\nKd 0.6 0.6 0.6\nKs 0.6 0.1 0.6\nNs 20\n");
    REQUIRE(both);
    CHECK(both->scene.materials[0].specular.x == doctest::Approx(0.4));
    CHECK(both->scene.materials[0].specular.y == doctest::Approx(0.1));
    CHECK(has_warning(both->report, "(Kd + Ks)"));
  }

  TEST_CASE("obj_reader: illum, Ks and Ns choose the finish") {
    const ScratchFolder folder;
    const auto finish = [&folder](const std::string& lines) {
      const auto loaded = read(folder, square + "f 1 2 3\n", "newmtl grey\nKd 0.1\n" + lines);
      REQUIRE(loaded);
      return loaded->scene.materials[0].finish;
    };
    CHECK(finish("illum 1\n") == Finish::diffuse);
    CHECK(finish("illum 1\nKs 0.5 0.5 0.5\nNs 20\n") == Finish::diffuse);
    CHECK(finish("illum 2\nKs 0.5 0.5 0.5\nNs 20\n") == Finish::glossy);
    CHECK(finish("Ks 0.5 0.5 0.5\nNs 20\n") == Finish::glossy);
    CHECK(finish("illum 3\nKs 0.9 0.9 0.9\n") == Finish::mirror);
    CHECK(finish("illum 3\nKs 0 0 0\n") == Finish::diffuse);
    CHECK(finish("illum 4\nNi 1.52\n") == Finish::glass);
    CHECK(finish("illum 7\n") == Finish::glass);
  }
}
