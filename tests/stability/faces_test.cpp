/// Faces that touch, cross, lie in each other or are next to nothing. Scenes go through a file here, as a user's do: reading is
/// where most of this is mended.
#include "io/scene_reader.hpp"
#include "io/scene_writer.hpp"
#include "tests/stability/whole_runs.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

constexpr double places[] = {0.07, 0.31, 0.77, 0.96};  // none behind a lamp
const Vec3 room_lo{0.0}, room_hi{4, 4, 3};

io::LoadedScene through_file(const Scene& scene) {
  const ScratchFolder folder;
  REQUIRE(io::write_scene(folder / "scene.obj", scene, {}));
  Expected<io::LoadedScene> loaded = io::read_scene(folder / "scene.obj");
  REQUIRE(loaded);
  return std::move(*loaded);
}

/// A room of 4 x 4 x 3 m of one reflectance.
struct Room {
  Scene scene;
  std::uint32_t wall, lamp;
  explicit Room(double reflectance) {
    wall = add_material(scene, diffuse(reflectance));
    lamp = add_material(scene, luminous(10, reflectance));
    add_box(scene, room_lo, room_hi, wall, true);
  }
  Room& hung_lamp() {
    add_rectangle(scene, {1.5, 1.5, 2.7}, {0, 1, 0}, {1, 0, 0}, lamp);
    return *this;
  }
};

Solution solution_of(const Scene& scene, double eps = 1e-4) {
  Wanted wanted;
  wanted.patch_size = 0.5;
  wanted.eps = eps;
  return solved(std::make_shared<const Scene>(scene), wanted);
}

std::vector<Rgb> light_in(const Solution& solution) {
  return light_at(solution, points_inside(room_lo, room_hi, places));
}

/// The energy that the ledger can't account for, as a share of all light that arrived in a room of one reflectance: what the
/// midpoint rule makes and loses on this mesh.
double share_made_or_lost(const Solution& s, double reflectance) {
  return std::abs(s.energy.residual()) * (1 - reflectance);
}
constexpr double midpoint_error = 0.01;

}  // namespace

TEST_SUITE("stability") {
  TEST_CASE("stability: faces written twice, or over others in their plane, make no light") {
    for (const double reflectance : {0.5, 0.95}) {
      const Room clean = std::move(Room(reflectance).hung_lamp());
      const Solution wanted = solution_of(clean.scene);
      const std::vector<Rgb> wanted_light = light_in(wanted);
      const auto compare = [&](const std::string& what, const Scene& scene, std::uint64_t overlaps) {
        const io::LoadedScene loaded = through_file(scene);
        const Solution found = solution_of(loaded.scene);
        const double difference = rms_difference(light_in(found), wanted_light);
        MESSAGE("reflectance " << reflectance << ", " << what << ": difference " << difference << ", residual "
                               << found.energy.residual() << " and " << wanted.energy.residual());
        CHECK(loaded.report.coplanar_overlaps == overlaps);
        CHECK(difference < 0.01);  // another mesh of the floor
        CHECK(share_made_or_lost(found, reflectance) < midpoint_error);
      };
      Room twice = clean;
      twice.scene.surfaces.insert(twice.scene.surfaces.end(), clean.scene.surfaces.begin(), clean.scene.surfaces.end());
      compare("every face twice", twice.scene, 0);
      Room triangles = clean;
      add_polygon(triangles.scene, {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}}, clean.wall);
      add_polygon(triangles.scene, {{0, 0, 0}, {4, 4, 0}, {0, 4, 0}}, clean.wall);
      compare("the floor again as triangles", triangles.scene, 2);
      Room rug = clean;
      add_rectangle(rug.scene, {0.7, 0.6, 0}, {2.5, 0.4, 0}, {-0.3, 2.2, 0}, clean.wall);
      add_rectangle(rug.scene, {0, 0.3, 0.2}, {0, 0, 2}, {0, 3.1, 0}, clean.wall);  // a neighbour's wall: it looks away
      compare("a rug, and a neighbour's wall", rug.scene, 2);
    }
  }

  TEST_CASE("stability: bodies that touch or cross each other are as dark inside, and outside as their union") {
    Room whole(0.7);
    whole.hung_lamp();
    Room touching = whole, crossing = whole;
    add_box(whole.scene, {1, 1, 0}, {3, 2, 1}, whole.wall, false);
    add_box(touching.scene, {1, 1, 0}, {2, 2, 1}, whole.wall, false);
    add_box(touching.scene, {2, 1, 0}, {3, 2, 1}, whole.wall, false);
    add_box(crossing.scene, {1, 1, 0}, {2.3, 2, 1}, whole.wall, false);
    add_box(crossing.scene, {1.8, 1, -0.5}, {3, 2, 1}, whole.wall, false);
    const Solution wanted = solution_of(through_file(whole.scene).scene);
    for (const Scene& scene : {touching.scene, crossing.scene}) {
      const Solution found = solution_of(through_file(scene).scene);
      const double difference = rms_difference(light_in(found), light_in(wanted));
      MESSAGE("difference " << difference << ", residual " << found.energy.residual() << " and "
                            << wanted.energy.residual());
      CHECK(difference < 0.01);
      CHECK(share_made_or_lost(found, 0.7) < midpoint_error);
    }
  }

  TEST_CASE("stability: a lamp in the ceiling's plane, in a hole of it or 1 mm below") {
    const double reflectance = 0.6;
    const auto panel = [](double z) { return std::array<Vec3, 3>{Vec3{1.5, 1.5, z}, {0, 1, 0}, {1, 0, 0}}; };
    Room flush(reflectance), below(reflectance);
    add_rectangle(flush.scene, panel(3)[0], panel(3)[1], panel(3)[2], flush.lamp);
    add_rectangle(below.scene, panel(2.999)[0], panel(2.999)[1], panel(2.999)[2], below.lamp);
    Scene hole = *PanelRoom(reflectance).scene;
    hole.materials[1] = flush.scene.materials[1];
    const Solution in_hole = solution_of(hole);
    const io::LoadedScene loaded = through_file(flush.scene);
    CHECK(loaded.report.coplanar_overlaps == 1);
    const Solution in_plane = solution_of(loaded.scene), hung = solution_of(through_file(below.scene).scene);
    const double difference = rms_difference(light_in(in_plane), light_in(in_hole));
    MESSAGE("in the plane against in a hole: " << difference << "; 1 mm below: "
                                               << rms_difference(light_in(hung), light_in(in_hole)));
    CHECK(difference < 0.005);
    CHECK(rms_difference(light_in(hung), light_in(in_hole)) < 0.005);
    // In any closed room of one reflectance the indirect light is ρΦ/(S(1-ρ)) on average.
    const double phi = 10 * std::numbers::pi, s = 2 * 16 + 4 * 12;
    const double exact = reflectance * phi / (s * (1 - reflectance));
    MESSAGE("mean indirect light over exact: " << mean_indirect(in_plane) / exact);
    CHECK(std::abs(mean_indirect(in_plane) / exact - 1) < 0.02);  // groups shoot their mean: docs/stability.md
  }

  TEST_CASE("stability: slivers of 1 : 1e6 in floor and walls change nothing") {
    Room clean(0.7);
    clean.hung_lamp();
    Room cut = clean;
    cut.scene.surfaces.erase(cut.scene.surfaces.begin() + 4);  // the floor, again as slivers and what they leave
    double y = 0;
    for (int strip = 0; strip < 40; ++strip) {
      add_rectangle(cut.scene, {0, y, 0}, {4, 0, 0}, {0, 4e-6, 0}, clean.wall);
      add_rectangle(cut.scene, {0, y + 4e-6, 0}, {4, 0, 0}, {0, 0.1 - 4e-6, 0}, clean.wall);
      y += 0.1;
    }
    // A fan of triangles from a corner: each 1 : 1e6.
    cut.scene.surfaces.erase(cut.scene.surfaces.begin());
    const Vec3 apex{0, 0, 0};
    Vec3 last{0, 4, 0};
    for (int k = 1; k <= 20; ++k) {
      const Vec3 next{0, 4, 4e-6 * k};
      add_polygon(cut.scene, {apex, last, next}, clean.wall);
      last = next;
    }
    add_polygon(cut.scene, {apex, last, {0, 4, 3}, {0, 0, 3}}, clean.wall);
    const Solution wanted = solution_of(clean.scene), found = solution_of(through_file(cut.scene).scene);
    const double difference = rms_difference(light_in(found), light_in(wanted));
    MESSAGE("difference " << difference << ", residual " << found.energy.residual() << " and "
                          << wanted.energy.residual());
    CHECK(difference < 0.01);
  }
}
