/// What goes wrong outside the program ends in one clear line, the right status, and no half-written file.
#include <doctest/doctest.h>

#include <string>

#include "tests/system/program.hpp"

using namespace lichthof::testing;

namespace {

constexpr const char* lamp_mtl = "newmtl lamp\nKd 0.5 0.5 0.5\nKe 5 5 5\n";
constexpr const char* square = "mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl lamp\nf 1 2 3 4\n";

/// Renders a scene text and expects it to be refused as bad input.
void expect_refused(const std::string& obj, const std::string& mtl, const std::string& complaint) {
  INFO(obj);
  const Folder folder;
  folder.write("lamp.mtl", mtl);
  const std::string scene = folder.write("scene.obj", obj);
  const Outcome outcome = ran({"render", scene, "-o", folder / "out.png", "--size", "8x6"});
  CHECK(outcome.status == 2);
  CHECK(outcome.out.empty());
  CHECK(outcome.complains(complaint));
  CHECK(folder.files() == std::vector<std::string>{"lamp.mtl", "scene.obj"});
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("bad input: scenes that are no scenes are told by file, line and what was expected") {
    expect_refused("", lamp_mtl, "scene.obj");
    expect_refused("\n\n# nothing\n", lamp_mtl, "scene.obj");
    expect_refused("mtllib missing.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", lamp_mtl, "missing.mtl");
    expect_refused("mtllib lamp.mtl\nv nan 0 0\nv 1 0 0\nv 1 1 0\nusemtl lamp\nf 1 2 3\n", lamp_mtl, "scene.obj:2");
    expect_refused("mtllib lamp.mtl\nv 0 0 0\nv 1 inf 0\nv 1 1 0\nusemtl lamp\nf 1 2 3\n", lamp_mtl, "scene.obj:3");
    expect_refused("mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl lamp\nf 1 2 99\n", lamp_mtl, "scene.obj:6");
    expect_refused("mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nusemtl lamp\nf 1 2 2\n", lamp_mtl, "scene.obj");
    expect_refused(square, "newmtl lamp\nKd 0.5 0.5 x\n", "lamp.mtl:2");
    expect_refused(square, "newmtl lamp\nKd 0.5 0.5 0.5\n", "no luminaire");
    expect_refused(std::string("\0\1\2binary", 9), lamp_mtl, "scene.obj");
  }

  TEST_CASE("bad input: faces without area and a Kd of 1.2 are mended with a warning") {
    const Folder folder;
    folder.write("lamp.mtl", "newmtl lamp\nKd 1.2 0.5 0.5\nKe 5 5 5\n");
    const std::string scene = folder.write("scene.obj", std::string(square) + "f 1 2 2\nf 1 1 3\n");
    const Outcome outcome =
        ran({"render", scene, "-o", folder / "out.png", "--size", "8x6", "--elements", "100", "--json"});
    CHECK(outcome.status == 0);
    CHECK(outcome.json()["import"]["degenerate_dropped"] == 2);
    CHECK(outcome.err.find("lamp.mtl:2") != std::string::npos);
    CHECK(folder.has("out.png"));
  }

  TEST_CASE("bad input: a scene without light can be ray traced, with a warning, and nothing else") {
    const Folder folder;
    folder.write("lamp.mtl", "newmtl lamp\nKd 0.5 0.5 0.5\n");
    const std::string scene = folder.write("scene.obj", square);
    const std::string points = folder.write("points.csv", "x,y,z,nx,ny,nz\n0,0,1,0,0,1\n");
    CHECK(ran({"solve", scene, "-o", folder / "out.lht"}).status == 2);
    CHECK(ran({"probe", scene, "--points", points, "-o", folder / "out.csv"}).status == 2);
    const Outcome outcome = ran({"render", scene, "-o", folder / "out.png", "--size", "8x6", "--method", "raytrace"});
    CHECK(outcome.status == 0);
    CHECK(outcome.complains("no luminaire"));
  }

  TEST_CASE("bad usage: options are told by name, before any work") {
    const Folder folder;
    write_room(folder);
    const std::string scene = folder / "room.toml", out = folder / "out.png";
    const auto refused = [&](std::vector<std::string> extra, const std::string& complaint) {
      std::vector<std::string> arguments{"render", scene, "-o", out};
      arguments.insert(arguments.end(), extra.begin(), extra.end());
      const Outcome outcome = ran(arguments);
      CHECK(outcome.status == 2);
      CHECK(outcome.complains(complaint));
      CHECK(outcome.out.empty());
      CHECK_FALSE(folder.has("out.png"));
    };
    refused({"--frobnicate"}, "--frobnicate");
    refused({"--eps", "nan"}, "--eps");
    refused({"--eps", "0"}, "--eps");
    refused({"--hemicube", "127"}, "--hemicube");
    refused({"--hemicube", "4096"}, "--hemicube");
    refused({"--cells", "2x"}, "--cells");
    refused({"--cells", "900000x4000000"}, "--cells");
    refused({"--cells", "5000x5000x1"}, "--cells");
    refused({"--patch", "-1"}, "--patch");
    refused({"--patch", "1e-9"}, "--patch");
    refused({"--element", "1e-300"}, "--element");
    refused({"--elements", "1e12"}, "--elements");
    refused({"--size", "640"}, "--size");
    refused({"--size", "999999x999999"}, "--size");
    refused({"--samples", "0"}, "--samples");
    refused({"--threads", "-1"}, "--threads");
    refused({"--unit", "furlong"}, "--unit");
    refused({"--up", "x"}, "--up");
    refused({"--method", "magic"}, "--method");
    refused({"--balance", "none"}, "--balance");
    refused({"--camera", "attic"}, "door, window");
    refused({"--camera", "1,2;3,4"}, "--camera");
    refused({"--camera", "1,2,1; 1,2,1"}, "same point");
    refused({"--camera", "1,2,1; 2,2,1; 0,0,1; 190"}, "180 degrees");
    refused({"--method", "raytrace", "--solution", folder / "x.lht"}, "--solution");
    CHECK(ran({}).status == 2);
    CHECK(ran({"paint"}).status == 2);
    CHECK(ran({"render", scene}).complains("--output"));
    CHECK(ran({"render", folder / "none.obj", "-o", out}).complains("none.obj"));
    CHECK(ran({"render", scene, "-o", folder / "out.jpg"}).complains(".exr, .hdr or .png"));
    CHECK(ran({"export", folder / "room.obj", "-o", folder / "x.glb"}).status == 2);
  }

  TEST_CASE("bad usage: a camera inside a wall or on a surface") {
    const Folder folder;
    // A solid block around the origin of the room's far corner: its inside is a wall's inside.
    folder.write("lamp.mtl", lamp_mtl);
    const std::string scene = folder.write(
        "scene.obj", std::string(square) +
                         "v 5 5 5\nv 5.0005 5 5\nv 5.0005 5.0005 5\nv 5 5.0005 5\nv 5 5 5.0005\nv 5.0005 5 5.0005\n"
                         "v 5.0005 5.0005 5.0005\nv 5 5.0005 5.0005\nf 8 7 6 5\nf 9 10 11 12\nf 5 6 10 9\nf 6 7 11 10\n"
                         "f 7 8 12 11\nf 8 5 9 12\n");
    for (const std::string eye : {"5.0002,5.0002,5.0002", "0.5,0.5,0"}) {
      const Outcome outcome = ran({"render", scene, "-o", folder / "out.png", "--camera", eye + "; 0,0,9"});
      CHECK(outcome.status == 2);
      CHECK(outcome.complains("--camera: the eye"));
    }
  }

  TEST_CASE("bad input: sensor points") {
    const Folder folder;
    write_room(folder);
    const auto refused = [&](const std::string& text, const std::string& complaint) {
      const std::string points = folder.write("points.csv", text);
      const Outcome outcome = ran({"probe", folder / "room.obj", "--points", points, "-o", folder / "out.csv"});
      CHECK(outcome.status == 2);
      CHECK(outcome.complains(complaint));
      CHECK_FALSE(folder.has("out.csv"));
    };
    refused("", "points.csv");
    refused("a,b,c\n1,2,3\n", "points.csv:1");
    refused("x,y,z,nx,ny,nz\n1,2,3,0,0\n", "points.csv:2");
    refused("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n1,2,q,0,0,1\n", "points.csv:3");
    refused("x,y,z,nx,ny,nz\n1,2,3,0,0,0\n", "points.csv:2");
  }

  TEST_CASE("bad input: damaged solutions") {
    const Folder folder;
    write_room(folder);
    CHECK(ran({"solve", folder / "room.obj", "-o", folder / "room.lht", "--elements", "300"}).status == 0);
    const std::string whole = contents(folder / "room.lht");
    const auto refused = [&](const std::string& bytes) {
      const std::string path = folder.write("bad.lht", bytes);
      for (const std::vector<std::string>& arguments :
           {std::vector<std::string>{"render", path, "-o", folder / "out.png"},
            {"export", path, "-o", folder / "out.ply"}}) {
        const Outcome outcome = ran(arguments);
        CHECK(outcome.status == 2);
        CHECK(outcome.complains("bad.lht"));
      }
      CHECK_FALSE(folder.has("out.png"));
      CHECK_FALSE(folder.has("out.ply"));
    };
    refused(whole.substr(0, whole.size() / 2));
    refused(whole.substr(0, 12));
    std::string flipped = whole;
    flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
    refused(flipped);
    CHECK(ran({"render", folder / "room.lht", "-o", folder / "out.png", "--cells", "2"}).complains("--cells"));
    CHECK(ran({"solve", folder / "room.lht", "-o", folder / "room.lht", "--patch", "1"}).complains("--patch"));
    CHECK(contents(folder / "room.lht") == whole);
  }

  TEST_CASE("output: what can't be written is told before the work, and never half-written") {
    const Folder folder;
    write_room(folder);
    const std::string scene = folder / "room.obj";
    for (const std::string path : {"/no/such/folder/out.png", "/proc/out.png"}) {
      const Outcome outcome = ran({"render", scene, "-o", path, "--elements", "1000000"});
      CHECK(outcome.status == 1);
      CHECK(outcome.complains(path));
      CHECK(outcome.seconds < 5);
    }
    CHECK(ran({"solve", scene, "-o", scene}).status == 2);
    CHECK(contents(scene).starts_with("mtllib"));

    // Full disks: a device that is always full, and a limit on the size of files.
    const Outcome full = ran({"solve", scene, "-o", "/dev/full", "--elements", "300"});
    CHECK(full.status == 1);
    CHECK(full.complains("/dev/full"));
    folder.write("old.lht", "precious");
    const Outcome limited = ran({"solve", scene, "-o", folder / "old.lht", "--elements", "3000"}, {2000, ""});
    CHECK(limited.status == 1);
    CHECK(limited.complains("old.lht"));
    CHECK(contents(folder / "old.lht") == "precious");
    const Outcome image =
        ran({"render", scene, "-o", folder / "out.exr", "--size", "64x48", "--elements", "300"}, {2000, ""});
    CHECK(image.status == 1);
    CHECK(image.complains("out.exr"));
    CHECK(folder.files() == std::vector<std::string>{"old.lht", "room.mtl", "room.obj", "room.toml"});
    const Outcome report = ran({"doctor", "--json"}, {std::nullopt, "/dev/full"});
    CHECK(report.status == 1);
    CHECK(report.complains("stdout"));
  }
}
