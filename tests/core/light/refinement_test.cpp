#include "core/light/refinement.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

std::shared_ptr<const Mesh> refined_mesh(const Scene& scene, const Mesh& mesh, const std::vector<std::uint8_t>& fineness) {
  return std::make_shared<const Mesh>(mesh_of(scene, mesh.options, mesh.lit_sides, fineness));
}

/// Some patches of every fineness.
std::vector<std::uint8_t> mixed(const Mesh& mesh) {
  std::vector<std::uint8_t> fineness(mesh.patches.size());
  for (std::size_t p = 0; p < fineness.size(); ++p) fineness[p] = static_cast<std::uint8_t>(1u << (p * 7 % 4));
  return fineness;
}

double deviation_of(const Solution& solution) {
  double sum = 0;
  for (const double deviation : deviations(solution)) sum += deviation;
  return sum;
}

}  // namespace

TEST_CASE("refinement: finer elements fill the same patches, which shoot from the same places") {
  const PanelRoom room(0.5);
  const auto coarse = mesh_with(*room.scene, 0.7), fine = refined_mesh(*room.scene, *coarse, mixed(*coarse));
  REQUIRE(fine->patches.size() == coarse->patches.size());
  for (std::size_t p = 0; p < fine->patches.size(); ++p) {
    const Patch &a = coarse->patches[p], &b = fine->patches[p];
    CHECK(b.columns == a.columns * b.fineness);
    CHECK(b.rows == a.rows * b.fineness);
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
  OneCell cell(furnace.scene, refined_mesh(*furnace.scene, *coarse, mixed(*coarse)));
  cell.solve(1e-6);
  const Solution solution = cell.solution();
  // Analytic factors of a closed scene sum to 1 for every receiver, however small; what is left is unshot.
  for (const Rgbf& irradiance : solution.irradiance) CHECK(irradiance.x == doctest::Approx(furnace.total()).epsilon(2e-5));
}

TEST_CASE("refinement: elements become smaller along the edge of a shadow and nowhere else") {
  // A lamp over a table: the floor is lit, but for the table's shadow.
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = add_material(*scene, diffuse(0.3)), lamp = add_material(*scene, luminous(100));
  add_rectangle(*scene, {0, 0, 0}, {8, 0, 0}, {0, 8, 0}, wall);
  add_rectangle(*scene, {3, 3, 1}, {2, 0, 0}, {0, 2, 0}, wall);
  add_polygon(*scene, {{3.9, 3.9, 3}, {3.9, 4.1, 3}, {4.1, 4.1, 3}, {4.1, 3.9, 3}}, lamp);
  OneCell cell(scene, mesh_with(*scene, 1.0));
  cell.solve(1e-3);
  const Solution solution = cell.solution();
  const Mesh& mesh = *solution.mesh;
  const std::vector<std::uint8_t> fineness = refined(mesh, deviations(solution), 0.5);
  // The lamp's 0.2 m at 3 m throw the table's edges to 2.5 .. 5.5 m, with penumbrae of 0.1 m.
  const auto crosses = [](double lo, double hi) { return (lo < 2.6 && hi > 2.4) || (lo < 5.6 && hi > 5.4); };
  std::size_t finer = 0;
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    if (fineness[p] == 1) continue;
    ++finer;
    const Patch& patch = mesh.patches[p];
    REQUIRE(patch.surface.value == 0);
    const Plane& plane = mesh.planes[patch.plane.value];
    const Vec3 lo = glm::min(plane.point(patch.lo), plane.point(patch.hi)), hi = glm::max(plane.point(patch.lo), plane.point(patch.hi));
    CHECK((crosses(lo.x, hi.x) || crosses(lo.y, hi.y)));
  }
  CHECK(finer > 4);
  CHECK(finer < mesh.patches.size() / 3);
  // And what it is for: less deviation is left, by fewer elements than by smaller ones everywhere.
  OneCell again(scene, refined_mesh(*scene, mesh, fineness));
  again.solve(1e-3);
  CHECK(deviation_of(again.solution()) < 0.75 * deviation_of(solution));
  CHECK(again.mesh->elements.size() < 2 * mesh.elements.size());
}

TEST_CASE("refinement: nothing to do is nothing done") {
  const Furnace furnace(1, 0.5);
  const Solution even = furnace.solution();
  const std::vector<std::uint8_t> none = refined(*even.mesh, deviations(even), 0.5);
  CHECK(std::all_of(none.begin(), none.end(), [](std::uint8_t f) { return f == 1; }));
}
