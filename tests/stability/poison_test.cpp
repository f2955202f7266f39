/// NaN, infinity and numbers next to nothing, put in at every stage: they are caught where they come in, and the line or the
/// patch is named.
#include <cstring>
#include <functional>
#include <limits>

#include "core/cell/plausible.hpp"
#include "core/protocol/plausible_change.hpp"
#include "io/image_writer.hpp"
#include "io/points_file.hpp"
#include "io/scene_bytes.hpp"
#include "io/scene_reader.hpp"
#include "io/solution_file.hpp"
#include "tests/stability/whole_runs.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
constexpr const char* poisons[] = {"nan", "-nan", "inf", "-inf", "1e999"};

const std::string good_mtl = "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n";
const std::string good_obj = "mtllib s.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

Expected<io::LoadedScene> read(const ScratchFolder& folder, const std::string& obj, const std::string& mtl) {
  folder.write("s.mtl", mtl);
  return io::read_scene(folder.write("s.obj", obj));
}

/// A furnace, solved to half, with its bytes as a file.
Solution small_solution() {
  Wanted wanted;
  wanted.patch_size = 0.5;
  return solved(Furnace(1, 0.5).scene, wanted);
}

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: a number that is none in a scene's files is named with its line") {
    const ScratchFolder folder;
    const std::string obj = folder / "s.obj", mtl = folder / "s.mtl", toml = folder / "s.toml";
    for (const std::string poison : poisons) {
      CAPTURE(poison);
      check_error(read(folder, good_obj + "v 0 " + poison + " 0\n", good_mtl), obj + ":8", "");
      check_error(read(folder, good_obj + "vt " + poison + " 0\n", good_mtl), obj + ":8", "");
      check_error(read(folder, good_obj + "vn 0 0 " + poison + "\n", good_mtl), obj + ":8", "");
      for (const std::string key : {"Kd", "Ke", "Ks"})
        check_error(read(folder, good_obj, good_mtl + key + " 0.1 " + poison + " 0.1\n"), mtl + ":4", key);
      for (const std::string key : {"Ns", "Ni"})
        check_error(read(folder, good_obj, good_mtl + key + " " + poison + "\n"), mtl + ":4", key);
    }
    folder.write("s.obj", good_obj), folder.write("s.mtl", good_mtl);
    for (const std::string poison : {"nan", "inf", "-inf"}) {
      CAPTURE(poison);
      for (const std::string& line :
           std::vector<std::string>{"[mesh]\npatch = " + poison, "[mesh]\nelement = " + poison,
                                    "[[camera]]\nname = \"c\"\neye = [0, " + poison + ", 0]\ntarget = [1, 1, 1]",
                                    "[[material]]\nname = \"m\"\nemission = [1, 1, " + poison + "]",
                                    "[[material]]\nname = \"m\"\nreflectance = [1, 1, " + poison + "]"}) {
        const std::string text = "[[part]]\nfile = \"s.obj\"\n" + line + "\n";
        check_error(io::read_scene(folder.write("s.toml", text)), toml, "expects");
      }
    }
  }

  TEST_CASE("stability: a number next to nothing is taken for what it is") {
    const ScratchFolder folder;
    const auto loaded =
        read(folder, "mtllib s.mtl\nusemtl m\nv 1e-320 0 0\nv 1 1e-310 0\nv 1 1 5e-324\nv 0 1 0\nf 1 2 3 4\n",
             "newmtl m\nKd 1e-320 0.5 0.5\nKe 1 1e-320 1\n");
    REQUIRE(loaded);
    CHECK(loaded->scene.surfaces[0].area == doctest::Approx(1));
    Wanted wanted;
    wanted.patch_size = 0.5;
    auto scene = std::make_shared<Scene>(*Furnace(1, 0.5).scene);
    scene->materials[0].radiance = Rgb{1, 1e-310, 1e-40};
    scene->materials[0].reflectance = Rgb{0.5, 0.5, 1e-310};
    const Solution solution = solved(scene, wanted);
    for (const Rgb& light : element_light(solution)) {
      REQUIRE(all_finite(light));
      REQUIRE(light.x == doctest::Approx(2 * std::numbers::pi).epsilon(1e-2));
      REQUIRE(light.y <= 1e-30);
    }
  }

  TEST_CASE("stability: a texture's texel that is no number becomes black, with a note") {
    const ScratchFolder folder;
    const float bad = std::numeric_limits<float>::quiet_NaN(), endless = std::numeric_limits<float>::infinity();
    const io::Image image{2, 2, {bad, 0.5f, 0.5f, endless, 0.5f, 0.5f, -endless, 0.5f, 0.5f, 1e-40f, 0.5f, 0.5f}};
    REQUIRE(io::write_image(folder / "t.exr", image.view()));
    const auto loaded = read(folder, good_obj, good_mtl + "map_Kd t.exr\n");
    REQUIRE(loaded);
    for (const float value : loaded->scene.textures[0].rgb) REQUIRE((value >= 0 && value <= 1));
    CHECK(std::any_of(loaded->report.notes.begin(), loaded->report.notes.end(),
                      [&](const std::string& note) { return note.starts_with(folder / "s.mtl:4"); }));
  }

  TEST_CASE("stability: sensor points that are no numbers are named with their line") {
    const ScratchFolder folder;
    for (const std::string poison : poisons)
      for (const int column : {0, 2, 5}) {
        std::string row;
        for (int k = 0; k < 6; ++k) row += (k ? "," : "") + (k == column ? poison : std::string(k == 4 ? "1" : "0"));
        check_error(io::read_points(folder.write("p.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,1\n" + row + "\n"), {}),
                    folder / "p.csv:3", "no number");
      }
    // Next to nothing is no direction.
    check_error(io::read_points(folder.write("p.csv", "x,y,z,nx,ny,nz\n0,0,0,0,0,1e-320\n"), {}), folder / "p.csv:2",
                "no length");
    CHECK(io::read_points(folder.write("p.csv", "x,y,z,nx,ny,nz\n1e-320,0,0,0,0,1\n"), {}));
  }

  TEST_CASE("stability: a solution file with light that is no number names array, element and patch") {
    const ScratchFolder folder;
    const Solution good = small_solution();
    for (const float poison :
         {static_cast<float>(no_number), static_cast<float>(infinity), -static_cast<float>(infinity)}) {
      Solution bad = good;
      bad.shot[17].y = poison;
      REQUIRE(io::write_solution(folder / "bad.lht", bad));
      check_error(io::read_solution(folder / "bad.lht"), folder / "bad.lht", "S of element 17, in patch 1,");
    }
    Solution small = good;
    small.irradiance[3] = Rgbf{1e-40f};
    REQUIRE(io::write_solution(folder / "small.lht", small));
    CHECK(io::read_solution(folder / "small.lht"));
  }

  TEST_CASE("stability: a scene's bytes with a number that is none name the surface or the material") {
    const Scene good = *Furnace(1, 0.5).scene;
    const auto refused = [&](const std::function<void(Scene&, double)>& spoil, const std::string& what) {
      for (const double poison : {no_number, infinity, -infinity}) {
        Scene bad = good;
        spoil(bad, poison);
        check_error(io::scene_from(io::scene_bytes(bad), io::texture_bytes(bad), "peer"), "peer", what);
      }
    };
    refused([](Scene& s, double x) { s.surfaces[3].corners[1].z = x; }, "surface 4");
    refused([](Scene& s, double x) { s.surfaces[2].area = x; }, "surface 3");
    refused([](Scene& s, double x) { s.surfaces[5].normal.x = x; }, "surface 6");
    refused([](Scene& s, double x) { s.materials[0].reflectance.y = x; }, "material 1");
    refused([](Scene& s, double x) { s.materials[0].radiance.y = x; }, "material 1");
    refused([](Scene& s, double x) { s.materials[0].specular.y = x; }, "material 1");
    CHECK(io::scene_from(io::scene_bytes(good), io::texture_bytes(good), "peer"));
  }

  TEST_CASE("stability: a shot between cells with a number that is none is refused, and its patch named") {
    const Furnace furnace(1, 0.5);
    Wanted wanted;
    wanted.patch_size = 0.25;
    OneCell cell(furnace.scene, lit_mesh(*furnace.scene, wanted));
    const Expected<CellGrid> grid = partition(*cell.mesh, bounds(*furnace.scene), {});
    REQUIRE(grid);
    const Shot good = cell.light.take_shot(cell.light.strongest().group, {CellId{0}, 0}, {});
    REQUIRE(fault_of(good, *grid).what == nullptr);
    REQUIRE(good.patches.size() > 2);
    const auto fault = [&](const std::function<void(Shot&, double)>& spoil, double poison) {
      Shot bad = good;
      spoil(bad, poison);
      return fault_of(bad, *grid);
    };
    struct Spoil {
      const char* what;
      std::uint32_t patch;
      std::function<void(Shot&, double)> with;
    };
    constexpr std::uint32_t whole = ShotFault::whole;
    const Spoil spoils[] = {
        {"radiosity", 2, [](Shot& s, double x) { s.patches[2].delta[5].y = float(x); }},
        {"area", 2, [](Shot& s, double x) { s.patches[2].area[5] = float(x); }},
        {"openness", 1, [](Shot& s, double x) { s.patches[1].openness[5] = float(x); }},
        {"radiosity", 1, [](Shot& s, double x) { s.patches[1].reflected.z = float(x); }},
        {"radiosity", 0, [](Shot& s, double x) { s.patches[0].emitted.z = float(x); }},
        {"outline", 0, [](Shot& s, double x) { s.patches[0].corners[0].x = x; }},
        {"outline", 0, [](Shot& s, double x) { s.patches[0].hi.x = x; }},
        {"outline", whole, [](Shot& s, double x) { s.corners[1].y = x; }},
        {"centre", whole, [](Shot& s, double x) { s.centre.x = x; }},
        {"area", whole, [](Shot& s, double x) { s.area = x; }},
        {"radius", whole, [](Shot& s, double x) { s.radius = x; }},
        {"plane", whole, [](Shot& s, double x) { s.plane.origin.x = x; }},
        {"plane", whole, [](Shot& s, double x) { s.plane.u.y = x; }},
        {"plane", whole, [](Shot& s, double x) { s.plane.normal.z = x; }},
    };
    for (const Spoil& spoil : spoils)
      for (const double poison : {no_number, infinity, -infinity}) {
        const ShotFault found = fault(spoil.with, poison);
        REQUIRE(found.what != nullptr);
        INFO("found " << found.what << ", wanted " << spoil.what);
        CHECK(std::string(found.what).find(spoil.what) != std::string::npos);
        CHECK(found.patch == spoil.patch);
        CHECK(found.group == good.group);
      }
    // Finite, and yet too much for sums in single precision; next to nothing is fine.
    CHECK(fault(spoils[0].with, 3e38).patch == 2);
    CHECK(fault(spoils[0].with, 1e-40).what == nullptr);
  }

  TEST_CASE(
      "stability: a change of light or reflectance that is no number is refused before it gets a number of its own") {
    for (const double poison : {no_number, infinity, -infinity, -1e-320}) {
      CHECK_FALSE(plausible(GeometryChange{{}, SetEmission{0, Rgb{1, poison, 1}}}));
      CHECK_FALSE(plausible(GeometryChange{{}, SetReflectance{0, Rgb{0.5, 0.5, poison}}}));
    }
    CHECK(plausible(GeometryChange{{}, SetEmission{0, Rgb{1e-320}}}));
  }

  TEST_CASE("stability: a bitmap's bytes of garbage are refused") {
    const std::vector<std::uint8_t> good = packed(HemicubeBitmap(32));
    REQUIRE(unpacked(good));
    for (std::size_t i = 0; i < good.size(); ++i)
      for (const std::uint8_t flip : {0x01, 0x80, 0xff}) {
        std::vector<std::uint8_t> bad = good;
        bad[i] ^= flip;
        if (const auto bitmap = unpacked(bad))
          CHECK(bitmap->words().size() == HemicubeBitmap(bitmap->resolution()).words().size());
      }
  }
}
