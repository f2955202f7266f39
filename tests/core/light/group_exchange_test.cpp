#include "core/light/group_exchange.hpp"

#include <doctest/doctest.h>

#include <numeric>

#include "core/light/expected_light.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

/// Fronts of a closed room alone: light reaches no back.
std::vector<LitSides> fronts(const Scene& scene) { return std::vector<LitSides>(scene.surfaces.size(), {true, false}); }

double total(const GroupExchange& exchange, std::uint32_t group) {
  double sum = 0;
  for (const GroupExchange::Link& link : exchange.links(group)) sum += static_cast<double>(link.area);
  return sum;
}

/// Two rooms of 4 x 3 x 2.5 m, a door of the given width between them, a lamp in the first.
Scene rooms_with_door(double door) {
  Scene scene;
  const std::uint32_t wall = test::add_material(scene, test::diffuse(0.6)),
                      lamp = test::add_material(scene, test::luminous(50));
  test::add_box(scene, {0, 0, 0}, {8, 3, 2.5}, wall, true);
  test::add_rectangle(scene, {4, 0, 0}, {0, 1.5 - door / 2, 0}, {0, 0, 2.5}, wall);
  test::add_rectangle(scene, {4, 1.5 + door / 2, 0}, {0, 1.5 - door / 2, 0}, {0, 0, 2.5}, wall);
  test::add_rectangle(scene, {1.8, 1.2, 2.4}, {0, 0.4, 0}, {0.4, 0, 0}, lamp);
  return scene;
}

}  // namespace

TEST_SUITE("group_exchange") {
  TEST_CASE("group_exchange: faces of a cube exchange as the closed form says") {
    Scene scene;
    test::add_box(scene, {0, 0, 0}, {1, 1, 1}, test::add_material(scene, test::luminous(1, 0.5)), true);
    const Mesh mesh = mesh_of(scene, {0.5, 0.125, 0}, fronts(scene));
    REQUIRE(mesh.groups.size() == 6);
    const GroupExchange exchange(scene, mesh, Parallel(1));
    // Faces 0 and 1 lie opposite each other; some thousand rays of each face tell them to a few hundredths.
    constexpr double opposite = 0.199824896, adjacent = 0.200043776, noise = 0.02;
    for (const GroupExchange::Link& link : exchange.links(0))
      CHECK(link.area == doctest::Approx(link.group == 1 ? opposite : adjacent).epsilon(noise / adjacent));
    CHECK(exchange.links(0).size() == 5);
    CHECK(total(exchange, 0) == doctest::Approx(1).epsilon(0.01));
  }

  TEST_CASE("group_exchange: a furnace is forecast") {
    Scene scene;
    test::add_box(scene, {0, 0, 0}, {3, 2, 1}, test::add_material(scene, test::luminous(1, 0.8)), true);
    const Mesh mesh = mesh_of(scene, {0.25, 0.0625, 0}, fronts(scene));
    const GroupExchange exchange(scene, mesh, Parallel(1));
    const double exact = 3 * std::numbers::pi / (1 - 0.8);  // three channels
    for (std::uint32_t g = 0; g < mesh.groups.size(); ++g)
      CHECK(exchange.irradiance(g) == doctest::Approx(exact).epsilon(0.1));
  }

  TEST_CASE("group_exchange: unshot light counts for as much more as a room is dimmer") {
    const Scene scene = rooms_with_door(0.1);
    const Mesh mesh = mesh_of(scene, {0.5, 0.125, 0}, fronts(scene));
    const GroupExchange exchange(scene, mesh, Parallel(1));
    double lit = 0, dim = 0, lit_weight = 0, dim_weight = 0, lit_area = 0, dim_area = 0;
    for (std::uint32_t g = 0; g < mesh.groups.size(); ++g) {
      const Group& group = mesh.groups[g];
      const bool is_dim = group.centre.x > 3.99;
      (is_dim ? dim : lit) += group.area * exchange.irradiance(g);
      (is_dim ? dim_weight : lit_weight) += group.area * exchange.weight(g);
      (is_dim ? dim_area : lit_area) += group.area;
    }
    const double dimmer = lit / lit_area / (dim / dim_area), more = dim_weight / dim_area / (lit_weight / lit_area);
    INFO("dimmer by " << dimmer << ", weighs " << more);
    CHECK(dimmer > 20);
    CHECK(more == doctest::Approx(dimmer).epsilon(0.5));
  }

  TEST_CASE("group_exchange: a luminaire that no ray of a group meets by chance is aimed at") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5)),
                        sun = test::add_material(scene, test::luminous(1e4));
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    test::add_rectangle(scene, {0.4, 0.4, 100}, {0, 0.2, 0}, {0.2, 0, 0}, sun);
    const Mesh mesh = mesh_of(scene, {0.5, 0.125, 0}, fronts(scene));
    const GroupExchange exchange(scene, mesh, Parallel(1));
    CHECK(exchange.irradiance(0) == doctest::Approx(3 * 1e4 * 0.04 / 1e4).epsilon(0.01));
  }

  TEST_CASE("expected_light: the light still to come is that of the closed form") {
    Scene scene;
    test::add_box(scene, {0, 0, 0}, {2, 2, 2}, test::add_material(scene, test::diffuse(0.7)), true);
    const Mesh mesh = mesh_of(scene, {0.5, 0.125, 0}, fronts(scene));
    const GroupExchange exchange(scene, mesh, Parallel(1));
    std::vector<std::uint32_t> groups(mesh.groups.size());
    std::iota(groups.begin(), groups.end(), 0u);
    ExpectedLight expected(exchange, mesh, groups);
    std::vector<ExpectedLight::Unshot> unshot(groups.size());
    for (std::size_t g = 0; g < groups.size(); ++g) unshot[g].answer = Rgbf{Rgb{0.7 * mesh.groups[g].area}};
    unshot[3].power = Rgbf{5, -5, 0};
    expected.find(unshot);
    Rgb arrived{0.0};
    for (std::size_t g = 0; g < groups.size(); ++g) arrived += mesh.groups[g].area * expected.irradiance(g);
    const double exact = 5 / (1 - 0.7);
    CHECK(arrived.x == doctest::Approx(exact).epsilon(0.05));
    CHECK(arrived.y == doctest::Approx(-exact).epsilon(0.05));
    CHECK(arrived.z == 0.0);
  }
}
