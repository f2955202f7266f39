#include "core/light/refinement.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "core/base/random.hpp"
#include "core/tracing/probe.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

std::shared_ptr<const Mesh> mesh_with_places(const Scene& scene, const Mesh& mesh, const std::vector<PlaceTree>& places) {
  return std::make_shared<const Mesh>(mesh_of(scene, mesh.options, mesh.lit_sides, places));
}

/// Places with elements of every size, side by side.
std::vector<PlaceTree> mixed(const Mesh& mesh) {
  std::vector<PlaceTree> places = places_of(mesh);
  for (std::size_t p = 0; p < places.size(); ++p) {
    if (p % 5 == 1) places[p] = PlaceTree::uniform(static_cast<int>(p / 5 % 4));
    if (p % 5 == 2) places[p].divide({0, 0, 0});
    if (p % 5 == 3) places[p].divide({1, 1, 0});
    if (p % 5 == 4) places[p].divide({2, 2, 1}), places[p].divide({1, 0, 1});
  }
  return places;
}

/// A lamp over a table: the floor is lit, but for the table's shadow. The lamp's 0.2 m at 3 m throw the table's edges to 2.5 m and 5.5 m
/// along both axes, with penumbrae of 0.1 m.
std::shared_ptr<const Scene> table_under_lamp(double reflectance) {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = add_material(*scene, diffuse(reflectance)), lamp = add_material(*scene, luminous(100));
  add_rectangle(*scene, {0, 0, 0}, {8, 0, 0}, {0, 8, 0}, wall);
  add_rectangle(*scene, {3, 3, 1}, {2, 0, 0}, {0, 2, 0}, wall);
  add_polygon(*scene, {{3.9, 3.9, 3}, {3.9, 4.1, 3}, {4.1, 4.1, 3}, {4.1, 3.9, 3}}, lamp);
  return scene;
}

/// Relative RMS error of the first pass at random points of the floor; the truth by 1024 rays to the lamp.
double error_on_floor(const std::shared_ptr<const Scene>& scene, const std::shared_ptr<const Mesh>& mesh) {
  OneCell cell(scene, mesh);
  cell.solve(1e-3);
  const auto lit = std::make_shared<const LitScene>(cell.solution());
  Random random(4);
  std::vector<SensorPoint> points;
  for (int i = 0; i < 4000; ++i) points.push_back({{8 * random.unit(), 8 * random.unit(), 0}, {0, 0, 1}});
  std::uint64_t rays = 0;
  const std::vector<PointLight> truth = sensor_light(lit, points, probe_options(0, 1024), Parallel(1), rays);
  double squares = 0, whole = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Rgb first = lit->total_irradiance(*lit->trace().surface_below(points[i].point, points[i].normal, 1e-3));
    squares += glm::dot(first - truth[i].direct, first - truth[i].direct), whole += glm::dot(truth[i].direct, truth[i].direct);
  }
  return std::sqrt(squares / whole);
}

}  // namespace

TEST_CASE("place_tree: a place is divided down to eighths, and bits that make no tree are left out") {
  PlaceTree tree;
  CHECK(tree.levels() == 0);
  CHECK(tree.leaf_count() == 1);
  tree.divide({2, 3, 1});
  CHECK(tree.levels() == 3);
  CHECK(tree.leaf_count() == 1 + 3 * 3);
  CHECK(tree.is_divided({0, 0, 0}));
  CHECK(tree.is_divided({1, 1, 0}));
  CHECK_FALSE(tree.is_divided({1, 0, 0}));
  CHECK_FALSE(tree.is_divided({3, 6, 2}));  // the last level
  CHECK(PlaceTree(tree.bits()) == tree);
  for (const int levels : {0, 1, 2, 3}) {
    CHECK(PlaceTree::uniform(levels).leaf_count() == 1u << 2 * levels);
    CHECK(PlaceTree::uniform(levels).levels() == levels);
  }
  CHECK(PlaceTree(0xffffffffu) == PlaceTree::uniform(3));
  CHECK(PlaceTree(0xfffffffeu) == PlaceTree());       // quarters of an undivided place
  CHECK(PlaceTree(1u | 1u << 5).leaf_count() == 4);  // quarters of an undivided quarter
}

TEST_CASE("refinement: finer elements fill the same patches, which shoot from the same places") {
  const PanelRoom room(0.5);
  const auto coarse = mesh_with(*room.scene, 0.7), fine = mesh_with_places(*room.scene, *coarse, mixed(*coarse));
  REQUIRE(fine->patches.size() == coarse->patches.size());
  for (std::size_t p = 0; p < fine->patches.size(); ++p) {
    const Patch &a = coarse->patches[p], &b = fine->patches[p];
    CHECK(b.columns == a.columns * b.fineness);
    CHECK(b.rows == a.rows * b.fineness);
    CHECK(b.area == doctest::Approx(a.area));
    CHECK(b.element_count <= a.element_count * b.fineness * b.fineness);
    std::vector<double> area(std::size_t{a.columns} * a.rows, 0.0);
    for (std::uint32_t e = b.first_element; e < b.first_element + b.element_count; ++e)
      area.at(shooting_place(b, fine->elements[e])) += fine->elements[e].area;
    for (std::uint32_t e = a.first_element; e < a.first_element + a.element_count; ++e)
      CHECK(area[shooting_place(a, coarse->elements[e])] == doctest::Approx(coarse->elements[e].area).epsilon(1e-5));
  }
}

TEST_CASE("refinement: a furnace with elements of all sizes is as exact as one of equal elements") {
  const Furnace furnace(1, 0.8);
  const auto coarse = mesh_with(*furnace.scene, 0.3);
  OneCell cell(furnace.scene, mesh_with_places(*furnace.scene, *coarse, mixed(*coarse)));
  cell.solve(1e-6);
  const Solution solution = cell.solution();
  // Analytic factors of a closed scene sum to 1 for every receiver, however small; what is left is unshot.
  for (const Rgbf& irradiance : solution.irradiance) CHECK(irradiance.x == doctest::Approx(furnace.total()).epsilon(2e-5));
}

TEST_CASE("refinement: elements become smaller along the edge of a shadow and nowhere else") {
  const auto scene = table_under_lamp(0.3);
  const auto mesh = mesh_with(*scene, 1.0);
  const auto finer_mesh = refined_mesh(scene, mesh, 0.5, Parallel(1));
  const auto crosses = [](double lo, double hi) { return (lo < 2.6 && hi > 2.4) || (lo < 5.6 && hi > 5.4); };
  std::size_t finer = 0;
  for (const Patch& patch : finer_mesh->patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      const Element& element = finer_mesh->elements[e];
      if (element.span == patch.fineness) continue;
      ++finer;
      REQUIRE(patch.surface.value == 0);
      // An edge is met by an element that was divided, or lies in the rim that was looked at: half as wide.
      Vec2 lo, hi;
      finer_mesh->element_rectangle(patch, element, lo, hi);
      const Plane& plane = finer_mesh->planes[patch.plane.value];
      const Vec2 reach = 2.0 * (hi - lo);
      const Vec3 a = plane.point(lo - reach), b = plane.point(hi + reach);
      CHECK((crosses(std::min(a.x, b.x), std::max(a.x, b.x)) || crosses(std::min(a.y, b.y), std::max(a.y, b.y))));
    }
  CHECK(finer / 4 > 10);
  CHECK(finer / 4 < mesh->elements.size() / 3);
}

TEST_CASE("refinement: what is refined is better than four times as many elements that are all alike") {
  const auto scene = table_under_lamp(0);
  const auto coarse = mesh_with(*scene, 1.0), fine = mesh_with(*scene, 0.25);
  const auto refined = refined_mesh(scene, coarse, 0.05, Parallel(1));
  CHECK(refined->patches.size() == coarse->patches.size());
  CHECK(4 * refined->elements.size() < fine->elements.size());
  CHECK(error_on_floor(scene, refined) < error_on_floor(scene, fine));
}

TEST_CASE("refinement: the smaller the share that may be left, the more elements there are") {
  const auto scene = table_under_lamp(0.3);
  const auto mesh = mesh_with(*scene, 1.0);
  std::size_t before = mesh->elements.size();
  for (const double keep : {0.5, 0.2, 0.05}) {
    const auto refined = refined_mesh(scene, mesh, keep, Parallel(1));
    CHECK(refined->elements.size() > before);
    CHECK(places_of(*refined_mesh(scene, mesh, keep, Parallel(2))) == places_of(*refined));
    before = refined->elements.size();
  }
}

TEST_CASE("refinement: nothing to do is nothing done") {
  const Furnace furnace(1, 0.5);
  const auto mesh = mesh_with(*furnace.scene, 0.3);
  CHECK(refined_mesh(furnace.scene, mesh, 0.5, Parallel(1)) == mesh);
}
