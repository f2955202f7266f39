#include "io/solution_file.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "io/section_file.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

Surface rectangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, std::uint32_t material) {
  Surface surface;
  surface.corners = {a, b, c, d};
  surface.normal = glm::normalize(glm::cross(b - a, d - a));
  surface.area = glm::length(glm::cross(b - a, d - a));
  surface.material = material;
  surface.source_face = 7;
  return surface;
}

/// A textured floor and a lamp above it, with arrays that are easy to tell apart.
Solution small_solution() {
  auto scene = std::make_shared<Scene>();
  scene->materials.resize(2);
  scene->materials[0].name = "floor";
  scene->materials[0].texture = 0;
  scene->materials[1].name = "lamp";
  scene->materials[1].radiance = {3, 2, 1};
  scene->textures.push_back({"checks", 2, 2, {0, 0, 0, 1, 1, 1, 1, 1, 1, 0.5f, 0.25f, 0.125f}});
  scene->surfaces.push_back(rectangle({0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, 0));
  scene->surfaces[0].texcoords = {{0, 0}, {2, 0}, {2, 1}, {0, 1}};
  scene->surfaces.push_back(rectangle({0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}, 1));
  scene->cameras.push_back({"court", {1, 2, 3}, {0, 0, 0}, {0, 0, 1}, 50});
  scene->file_frame = {0.01, true};
  scene->patch_size = 0.4;
  Solution solution;
  solution.options.mesh.target_elements = 200;
  solution.options.cells = {2, 1, 1};
  solution.options.eps = 1e-3;
  solution.options.method = TransferMethod::hemicube;
  const std::vector<LitSides> lit{{true, false}, {true, true}};
  std::vector<PlaceTree> places = places_of(mesh_of(*scene, solution.options.mesh, lit));
  places.front().divide({0, 0, 0}), places.back().divide({1, 1, 0});
  solution.mesh = std::make_shared<const Mesh>(mesh_of(*scene, solution.options.mesh, lit, places));
  solution.scene = scene;
  for (std::size_t e = 0; e < solution.mesh->elements.size(); ++e) {
    const float x = static_cast<float>(e);
    solution.irradiance.push_back({x, 0.5f * x, 0.1f});
    solution.direct_irradiance.push_back({0.5f * x, 0, 0});
    solution.shot.push_back({-x, 1, 2});
  }
  solution.energy = {10, 4, 3, 2, 1, 0.5, 1.5, 0.75};
  solution.counters.shots = 42;
  solution.counters.rays = 45, solution.counters.rays_saved = 44;
  solution.counters.clusters_cut = 43;
  solution.counters.clusters_behind = 46, solution.counters.rays_remembered = 47;
  solution.seconds_radiosity = 1.5;
  solution.converged = true;
  return solution;
}

}  // namespace

TEST_SUITE("io") {
  TEST_CASE("solution_file: everything comes back, and the mesh is the same") {
    const ScratchFolder folder;
    const Solution solution = small_solution();
    REQUIRE(write_solution(folder / "s.lht", solution));
    CHECK(folder.names() == std::vector<std::string>{"s.lht"});
    CHECK(is_solution_file(folder / "s.lht"));
    const auto again = read_solution(folder / "s.lht");
    REQUIRE_MESSAGE(again, again.error().text());
    CHECK(again->irradiance == solution.irradiance);
    CHECK(again->direct_irradiance == solution.direct_irradiance);
    CHECK(again->shot == solution.shot);
    CHECK(again->pending == std::vector<Rgbf>(solution.irradiance.size(), Rgbf{0.f}));
    CHECK(again->energy.escaped == 3);
    CHECK(again->energy.mirrored == 1);
    CHECK(again->energy.mirrored_direct == 0.5);
    CHECK(again->energy.gain_direct == 1.5);
    CHECK(again->energy.gain_indirect == 0.75);
    CHECK(again->counters.shots == 42);
    CHECK(again->counters.rays == 45);
    CHECK(again->counters.rays_saved == 44);
    CHECK(again->counters.clusters_cut == 43);
    CHECK(again->counters.clusters_behind == 46);
    CHECK(again->counters.rays_remembered == 47);
    CHECK(again->seconds_radiosity == 1.5);
    CHECK(again->converged);
    CHECK(again->options.cells == solution.options.cells);
    CHECK(again->options.method == TransferMethod::hemicube);
    CHECK(again->options.mesh.target_elements == 200);
    CHECK(again->mesh->patches.size() == solution.mesh->patches.size());
    CHECK(again->mesh->lit_sides.size() == 2);
    CHECK_FALSE(again->mesh->lit_sides[0].back);
    const Scene &scene = *again->scene, &original = *solution.scene;
    CHECK(scene.file_frame.y_up);
    CHECK(scene.file_frame.metres_per_unit == 0.01);
    CHECK(*scene.patch_size == 0.4);
    CHECK(scene.cameras[0].name == "court");
    CHECK(scene.textures[0].rgb == original.textures[0].rgb);
    CHECK(scene.materials[1].radiance == original.materials[1].radiance);
    CHECK(scene.surfaces[0].texcoords == original.surfaces[0].texcoords);
    CHECK(scene.surfaces[1].source_face == 7);
  }

  TEST_CASE("solution_file: the same solution gives the same bytes") {
    const ScratchFolder folder;
    REQUIRE(write_solution(folder / "a.lht", small_solution()));
    REQUIRE(write_solution(folder / "b.lht", small_solution()));
    CHECK(folder.read("a.lht") == folder.read("b.lht"));
  }

  TEST_CASE("solution_file: a truncated file is one clear line, wherever it ends") {
    const ScratchFolder folder;
    REQUIRE(write_solution(folder / "s.lht", small_solution()));
    const std::string whole = folder.read("s.lht");
    for (std::size_t size = 0; size < whole.size(); size += size < 700 ? 1 : 37) {
      folder.write("t.lht", whole.substr(0, size));
      check_error(read_solution(folder / "t.lht"), folder / "t.lht", size < 8 ? "is no solution file" : "truncated");
    }
  }

  TEST_CASE("solution_file: a damaged byte anywhere is found") {
    const ScratchFolder folder;
    REQUIRE(write_solution(folder / "s.lht", small_solution()));
    const std::string whole = folder.read("s.lht");
    for (std::size_t at = 0; at < whole.size(); at += at < 700 ? 1 : 13) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
      folder.write("d.lht", damaged);
      const auto result = read_solution(folder / "d.lht");
      INFO(at);
      REQUIRE_FALSE(result);
      CHECK(result.error().code == ErrorCode::bad_input);
      CHECK(result.error().text().find('\n') == std::string::npos);
    }
    folder.write("d.lht", whole + "x");
    check_error(read_solution(folder / "d.lht"), folder / "d.lht", "damaged");
  }

  TEST_CASE("solution_file: other files, versions and folders are told apart") {
    const ScratchFolder folder;
    check_error(read_solution(folder / "gone.lht"), folder / "gone.lht", "No such file");
    check_error(read_solution(folder.write("t.lht", "a text")), folder / "t.lht", "is no solution file");
    check_error(read_solution(folder / ""), folder / "", "is a folder");
    REQUIRE(write_sections(folder / "v.lht", {"\x89LHT\r\n\x1a\n", 1, "solution file"}, {}));
    check_error(read_solution(folder / "v.lht"), folder / "v.lht", "of format 1; this program reads format 8");
    REQUIRE(write_sections(folder / "e.lht", {"\x89LHT\r\n\x1a\n", 8, "solution file"}, {{"head", "x"}}));
    check_error(read_solution(folder / "e.lht"), folder / "e.lht", "damaged");
    CHECK_FALSE(is_solution_file(folder / "t.lht"));
  }

  TEST_CASE("solution_file: an unwritable output and a full disk are one clear line, the older file stays") {
    const ScratchFolder folder;
    check_error(write_solution(folder / "no/s.lht", small_solution()), folder / "no/s.lht", "No such file");
    check_error(write_solution("/dev/full", small_solution()), "/dev/full", "No space left on device");
  }

  TEST_CASE("section_file: a section that claims more than it may is refused before memory is taken") {
    const ScratchFolder folder;
    const SectionFormat format{"testfile", 1, "test file"};
    REQUIRE(write_sections(folder / "s", format, {{"zeros", std::string(8 << 20, '\0')}, {"empty", ""}}));
    CHECK(std::filesystem::file_size(folder / "s") < 10000);
    const auto file = SectionFile::open(folder / "s", format);
    REQUIRE(file);
    CHECK(file->section("zeros", 8 << 20)->size() == 8 << 20);
    CHECK(file->section("empty", 0)->empty());
    check_error(file->section("zeros", 1000), folder / "s", "larger than it can be");
    check_error(file->section("other", 1000), folder / "s", "has no section 'other'");
  }
}
