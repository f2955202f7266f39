#include "core/light/cell_light.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/random.hpp"
#include "core/light/form_factor.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

/// Power that arrives is Σ H A over element centres; the exact integral differs by the error of that midpoint rule.
/// This mesh has 1.4 %.
constexpr double midpoint_error = 0.02;

/// Area mean of irradiance over the lit fronts, the light still to come included or not.
double mean_irradiance(const Solution& s, bool pending) {
  double sum = 0, area = 0;
  for (const Patch& patch : s.mesh->patches) {
    if (patch.back) continue;
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      sum += s.mesh->elements[e].area * (s.irradiance[e].x + (pending ? s.pending[e].x : 0.f));
      area += s.mesh->elements[e].area;
    }
  }
  return sum / area;
}

test::OneCell solved(const std::shared_ptr<const Scene>& scene, double patch_size, double eps, unsigned threads = 1) {
  test::OneCell cell(scene, test::mesh_with(*scene, patch_size), {}, threads);
  cell.solve(eps);
  return cell;
}

}  // namespace

TEST_SUITE("cell_light") {
  TEST_CASE("cell_light: in a furnace every element ends at π Ke / (1 - ρ)") {
    for (const double reflectance : {0.5, 0.9}) {
      const test::Furnace furnace(1.0, reflectance);
      const test::OneCell cell = solved(furnace.scene, 0.25, 5e-4);
      const Solution s = cell.solution();
      double worst = 0;
      for (std::size_t e = 0; e < s.irradiance.size(); ++e)
        worst = std::max(worst, std::abs((s.irradiance[e].x + s.pending[e].x) / furnace.total() - 1));
      INFO("reflectance " << reflectance << ", worst " << worst << ", shots " << cell.shots);
      CHECK(std::abs(mean_irradiance(s, true) / furnace.total() - 1) < 1e-3);
      CHECK(worst < 5e-3);
      for (const Rgbf& direct : s.direct_irradiance) REQUIRE(direct.x == doctest::Approx(furnace.direct()).epsilon(1e-4));
    }
  }

  TEST_CASE("cell_light: shooting ends however small eps is, and what is left is rounding") {
    for (const double reflectance : {0.5, 0.95}) {
      const test::Furnace furnace(1.0, reflectance);
      test::OneCell cell(furnace.scene, test::mesh_with(*furnace.scene, 0.5));
      cell.solve(1e-30);
      const CellPower power = cell.light.power();
      INFO("reflectance " << reflectance << ", shots " << cell.shots);
      CHECK(cell.shots < 20000);
      // A group shoots by the sum over its patches; what is left of it may have either sign.
      CHECK(std::abs(power.unshot.x) <= 1e-6 * power.received.x);
      CHECK(cell.light.strongest().power_w == 0);
    }
  }

  TEST_CASE("cell_light: unoccluded direct light is the closed form") {
    const test::PanelRoom room;
    const test::OneCell cell = solved(room.scene, 0.5, 1e-3);
    const Solution s = cell.solution();
    const Polygon panel = room.scene->surfaces.back().corners;
    double worst = 0;
    for (const Patch& patch : s.mesh->patches) {
      if (patch.back) continue;
      const Plane& plane = s.mesh->planes[patch.plane.value];
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        const double exact =
            1000 * std::numbers::pi * form_factor(plane.point(s.mesh->elements[e].centre), plane.normal, panel);
        REQUIRE(s.irradiance[e].x == s.direct_irradiance[e].x);  // the walls are black
        if (exact > 0) worst = std::max(worst, std::abs(s.irradiance[e].x / exact - 1));
        else REQUIRE(s.irradiance[e].x == 0);
      }
    }
    INFO("worst " << worst);
    CHECK(worst < 3e-5);
  }

  TEST_CASE("cell_light: energy is neither lost nor made") {
    const test::PanelRoom room(0.7);
    const test::OneCell cell = solved(room.scene, 0.5, 1e-3);
    const CellPower power = cell.light.power();
    CHECK(power.emitted.x == doctest::Approx(1000 * std::numbers::pi));
    const Rgb residual = power.emitted - power.absorbed - power.unshot;
    INFO("residual " << residual.x / power.emitted.x);
    CHECK(std::abs(residual.x) < midpoint_error * power.emitted.x);
    // What the shots carried and what arrived of them is what the elements say.
    CHECK(power.shot.x == doctest::Approx(cell.sent_w.x).epsilon(1e-5));
    CHECK(power.received.x == doctest::Approx(cell.received_w.x).epsilon(1e-5));
    const Solution s = cell.solution();
    double received = 0, shot = 0;
    for (std::size_t e = 0; e < s.irradiance.size(); ++e) {
      received += double(s.mesh->elements[e].area) * s.irradiance[e].x;
      shot += double(s.mesh->elements[e].area) * s.shot[e].x;
    }
    CHECK(power.received.x == doctest::Approx(received).epsilon(1e-4));
    CHECK(power.shot.x == doctest::Approx(shot).epsilon(1e-4));
  }

  TEST_CASE("cell_light: in a closed box with the lamp outside it is exactly dark") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.8));
    test::add_box(*scene, {-1, -1, 0.3}, {1, 1, 1.7}, grey, true);  // its fronts look inwards
    test::add_box(*scene, {-3, -3, 0}, {3, 3, 4}, grey, true);
    test::add_rectangle(*scene, {-0.5, -0.5, 3.9}, {0, 1, 0}, {1, 0, 0}, test::add_material(*scene, test::luminous(10)));
    // All sides may be lit, for all the mesh knows.
    test::OneCell cell(scene, test::mesh_with(*scene, 0.5, false));
    cell.solve(3e-3);
    const Solution s = cell.solution();
    double brightest = 0;
    for (const Patch& patch : s.mesh->patches)
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
        if (patch.surface.value < 6 && !patch.back) REQUIRE(s.irradiance[e] == s.shot[e] * 0.f);
        brightest = std::max(brightest, double(s.irradiance[e].x));
      }
    CHECK(brightest > 1);
  }

  TEST_CASE("cell_light: the number of threads changes no bit") {
    const auto scene = test::two_rooms();
    const Solution one = solved(scene, 0.25, 5e-3, 1).solution(), two = solved(scene, 0.25, 5e-3, 2).solution();
    CHECK(one.irradiance == two.irradiance);
    CHECK(one.direct_irradiance == two.direct_irradiance);
    CHECK(one.shot == two.shot);
    CHECK(one.pending == two.pending);
  }

  TEST_CASE("cell_light: the order of shots changes the path and not the end") {
    // With a table in each room: what a shooter's rays find must not depend on how its light is shared out among shots.
    const auto scene = test::two_rooms();
    const test::OneCell reference = solved(scene, 0.5, 1e-7);
    for (const std::uint64_t seed : {1u, 2u}) {
      test::OneCell cell(scene, reference.mesh);
      Random random(seed);
      std::vector<GroupId> groups;
      for (std::uint32_t g = 0; g < cell.mesh->groups.size(); ++g)
        if (cell.mesh->group_is_lit[g]) groups.push_back({g});
      for (int round = 0; round < 4; ++round) {
        for (std::size_t k = groups.size(); k > 1; --k)
          std::swap(groups[k - 1], groups[random.below(static_cast<std::uint32_t>(k))]);
        for (const GroupId group : groups) {
          cell.light.strongest();
          cell.shoot(group);
        }
      }
      cell.solve(1e-7);
      const double difference = test::relative_rms(cell.solution(), reference.solution());
      INFO("difference " << difference);
      // Every group may keep eps of the largest one's power: measured 170 eps, from eps 1e-5 to 1e-8.
      CHECK(difference < 3e-5);
    }
  }

  TEST_CASE("cell_light: the strongest group is a luminaire at first, and its power the scale of eps") {
    const test::PanelRoom room(0.5);
    test::OneCell cell(room.scene, test::mesh_with(*room.scene, 0.5));
    const CellLight::Candidate first = cell.light.strongest();
    CHECK(room.scene->material_of(room.scene->surfaces[cell.mesh->groups[first.group.value].surface.value]).emits());
    const Group& group = cell.mesh->groups[first.group.value];
    const double largest_w = cell.light.largest_initial_power();
    CHECK(first.power_w == doctest::Approx(largest_w * cell.exchange->weight(first.group.value)).epsilon(1e-5));
    CHECK(largest_w == doctest::Approx(3 * 1000 * std::numbers::pi * group.area).epsilon(1e-5));
    cell.shoot(first.group);
    CHECK(cell.light.power().shot.x == doctest::Approx(1000 * std::numbers::pi * group.area).epsilon(1e-5));
  }

  TEST_CASE("cell_light: a stored solution is resumed where it was left") {
    const test::PanelRoom room(0.6);
    test::OneCell first = solved(room.scene, 0.5, 1e-2);
    const Solution stored = first.solution();
    test::OneCell second(room.scene, first.mesh);
    second.light.load(stored);
    const Solution again = second.solution();
    CHECK(again.irradiance == stored.irradiance);
    CHECK(again.direct_irradiance == stored.direct_irradiance);
    CHECK(again.shot == stored.shot);
    const CellPower a = first.light.power(), b = second.light.power();
    CHECK(a.unshot.x == doctest::Approx(b.unshot.x).epsilon(1e-4));
    CHECK(a.absorbed.x == doctest::Approx(b.absorbed.x).epsilon(1e-5));
    first.solve(1e-4), second.solve(1e-4);
    const double difference = test::relative_rms(second.solution(), first.solution());
    INFO("difference " << difference);
    CHECK(difference < 2e-3);
    for (std::size_t e = 0; e < again.shot.size(); ++e)
      REQUIRE(second.solution().direct_irradiance[e].x == doctest::Approx(first.solution().direct_irradiance[e].x).epsilon(1e-5));
  }

  TEST_CASE("cell_light: changed lights and materials end where a fresh solution does") {
    const test::PanelRoom room(0.6);
    test::OneCell cell = solved(room.scene, 0.5, 1e-4);
    const auto mesh = cell.mesh;
    const double end_w = 1e-4 * cell.light.largest_initial_power();

    const auto expect_as_fresh = [&](const Rgb& radiance, const Rgb& reflectance) {
      auto changed = std::make_shared<Scene>(*room.scene);
      changed->materials[0].reflectance = reflectance;
      changed->materials[1].radiance = radiance;
      test::OneCell fresh(changed, test::mesh_with(*changed, 0.5));
      REQUIRE(fresh.mesh->elements.size() == mesh->elements.size());
      fresh.solve_to(end_w);
      cell.solve_to(end_w);
      const double difference = test::relative_rms(cell.solution_by(fresh.mesh), fresh.solution());
      INFO("difference " << difference);
      CHECK(difference < 5e-3);
    };
    cell.light.set_emission(1, Rgb{500, 1000, 2000});
    expect_as_fresh(Rgb{500, 1000, 2000}, Rgb{0.6});
    cell.light.set_reflectance(0, Rgb{0.3, 0.6, 0.7});
    expect_as_fresh(Rgb{500, 1000, 2000}, Rgb{0.3, 0.6, 0.7});
    cell.light.set_reflectance(0, Rgb{0.1});
    expect_as_fresh(Rgb{500, 1000, 2000}, Rgb{0.1});
  }

  TEST_CASE("cell_light: a lamp turned off leaves the room dark") {
    const test::PanelRoom room(0.6);
    test::OneCell cell = solved(room.scene, 0.5, 1e-4);
    const double before = mean_irradiance(cell.solution(), true);
    const double end_w = 1e-4 * cell.light.largest_initial_power();
    cell.light.set_emission(1, Rgb{0.0});
    cell.solve_to(end_w);
    const Solution s = cell.solution();
    CHECK(std::abs(mean_irradiance(s, true)) < 3e-3 * before);
    for (const Rgbf& direct : s.direct_irradiance) REQUIRE(std::abs(direct.x) < 1e-3);
  }

  TEST_CASE("cell_light: the paper's hemicube agrees with rays within its pixels") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.5));
    test::add_box(*scene, {0, 0, 0}, {4, 4, 3}, grey, true);
    test::add_box(*scene, {1, 1, 0.5}, {2, 2.5, 1.5}, grey, false);
    test::add_rectangle(*scene, {2, 2, 2.9}, {0, 0.5, 0}, {0.5, 0, 0}, test::add_material(*scene, test::luminous(10)));
    const auto mesh = test::mesh_with(*scene, 0.25);
    TransferOptions by_items;
    by_items.method = TransferMethod::hemicube;
    by_items.hemicube_resolution = 256;
    test::OneCell rays(scene, mesh), items(scene, mesh, by_items);
    rays.solve(1e-2);
    items.solve(1e-2);
    const double mean_by_rays = mean_irradiance(rays.solution(), true), mean_by_items = mean_irradiance(items.solution(), true);
    INFO("means " << mean_by_rays << " and " << mean_by_items);
    CHECK(mean_by_items == doctest::Approx(mean_by_rays).epsilon(0.03));
    const double difference = test::relative_rms(items.solution(), rays.solution());
    INFO("difference " << difference);
    CHECK(difference < 0.15);  // one centre per shooter: penumbras become edges
  }

  TEST_CASE("cell_light: who sees the dark half of a group gets the light of the dark half") {
    // A lamp over one half of a floor, a black wall between the halves, and a receiver on the dark side that sees the floor as one.
    auto scene = std::make_shared<Scene>();
    const std::uint32_t white = test::add_material(*scene, test::diffuse(0.8)),
                        black = test::add_material(*scene, test::diffuse(0.0)),
                        lamp = test::add_material(*scene, test::luminous(1));
    test::add_rectangle(*scene, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, white);
    test::add_rectangle(*scene, {1, 0, 0}, {0.3, 0, 3}, {0, 2, 0}, black);  // leaning, so that no grid line divides the floor
    test::add_rectangle(*scene, {0, 0, 2.5}, {0, 2, 0}, {1, 0, 0}, lamp);
    test::add_rectangle(*scene, {8, 0, 0}, {0, 0, 4}, {0, 2, 0}, black);
    test::OneCell cell(scene, test::mesh_with(*scene, 2.0, false));
    cell.solve(1e-4);
    const Solution solution = cell.solution();
    const auto arriving_w = [&](std::uint32_t surface) {
      double sum = 0;
      for (const Patch& patch : solution.mesh->patches)
        for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e)
          if (patch.surface.value == surface) sum += solution.mesh->elements[e].area * solution.total(e).x;
      return sum;
    };
    std::uint32_t groups = 0;
    for (const Group& group : solution.mesh->groups) groups += group.surface.value == 0 && !group.back;
    REQUIRE(groups == 1);
    CHECK(arriving_w(0) > 0.5);
    CHECK(std::abs(arriving_w(3)) < 1e-4 * arriving_w(0));  // .004 of it as a product of means
  }

  TEST_CASE("cell_light: a luminous ceiling of many elements costs each receiver no more rays, and gives the same light") {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.3));
    test::add_box(*scene, {0, 0, 0}, {6, 6, 3}, grey, true);
    test::add_box(*scene, {2, 2, 0.5}, {4, 3.5, 1.5}, grey, false);
    scene->surfaces[5].material = test::add_material(*scene, test::luminous(10));
    const auto shine = [&](double patch_size, double& rays_per_element) {
      const auto mesh = test::mesh_with(*scene, patch_size);
      test::OneCell cell(scene, mesh);
      std::uint64_t rays = 0;
      for (std::uint32_t g = 0; g < mesh->groups.size(); ++g)
        if (mesh->groups[g].surface.value == 5 && !mesh->groups[g].back) {
          cell.light.strongest();
          rays += cell.shoot(GroupId{g}).rays;
        }
      rays_per_element = double(rays) / double(mesh->elements.size());
      return mean_irradiance(cell.solution(), true);
    };
    double rays_of_few = 0, rays_of_many = 0;
    const double few = shine(1.5, rays_of_few), many = shine(0.25, rays_of_many);  // 256 and 9216 elements shine
    INFO("rays per element " << rays_of_few << " and " << rays_of_many << ", mean light " << few << " and " << many);
    CHECK(rays_of_many < 1.5 * rays_of_few);
    CHECK(std::abs(many / few - 1) < 0.01);
  }
}
