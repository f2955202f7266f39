#include "core/scene/joined_facets.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

double emitting_area(const Scene& scene) {
  double area = 0;
  for (const Surface& surface : scene.surfaces)
    if (scene.material_of(surface).emits()) area += surface.area;
  return area;
}

/// A lamp of n x n squares, or of twice as many triangles.
Scene tiled_lamp(int n, bool triangles) {
  Scene scene;
  const std::uint32_t lamp = test::add_material(scene, test::luminous(10));
  const auto at = [&](int x, int y) { return Vec3{x * 0.1, y * 0.1, 2}; };
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x)
      if (triangles) {
        test::add_polygon(scene, {at(x, y), at(x + 1, y), at(x + 1, y + 1)}, lamp);
        test::add_polygon(scene, {at(x, y), at(x + 1, y + 1), at(x, y + 1)}, lamp);
      } else {
        test::add_polygon(scene, {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)}, lamp);
      }
  return scene;
}

}  // namespace

TEST_SUITE("joined_facets") {
  TEST_CASE("joined_facets: a lamp of a thousand facets becomes one surface") {
    for (const bool triangles : {false, true})
      for (const int n : {2, 7, 32}) {
        CAPTURE(n);
        CAPTURE(triangles);
        Scene scene = tiled_lamp(n, triangles);
        const double emitting = emitting_area(scene);
        CHECK(join_facets(scene) == static_cast<std::size_t>(n * n * (triangles ? 2 : 1) - 1));
        REQUIRE(scene.surfaces.size() == 1);
        CHECK(scene.surfaces[0].corners.size() == 4);
        CHECK(scene.surfaces[0].area == doctest::Approx(emitting));
        CHECK(lichthof::area(scene.surfaces[0].corners) == doctest::Approx(emitting));
      }
  }

  TEST_CASE("joined_facets: a disc of sectors becomes one polygon") {
    Scene scene;
    const std::uint32_t lamp = test::add_material(scene, test::luminous(10));
    const int sectors = 48;
    const auto rim = [](int k) {
      const double angle = 2 * std::numbers::pi * (k % sectors) / sectors;
      return Vec3{std::cos(angle), std::sin(angle), 0};
    };
    for (int k = 0; k < sectors; ++k) test::add_polygon(scene, {{0, 0, 0}, rim(k), rim(k + 1)}, lamp);
    const double emitting = emitting_area(scene);
    join_facets(scene);
    CHECK(scene.surfaces.size() <= 2);
    CHECK(emitting_area(scene) == doctest::Approx(emitting));
  }

  TEST_CASE("joined_facets: what is bent, of another material, dark, or not convex stays apart") {
    Scene scene;
    const std::uint32_t lamp = test::add_material(scene, test::luminous(10)),
                        other = test::add_material(scene, test::luminous(20)),
                        grey = test::add_material(scene, test::diffuse(0.5));
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, lamp);
    test::add_rectangle(scene, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, other);   // another material
    test::add_rectangle(scene, {0, 1, 0}, {1, 0, 0}, {0, 1, 0.1}, lamp);  // bent
    test::add_rectangle(scene, {0, -1, 0}, {0, 1, 0}, {1, 0, 0}, lamp);   // looks down
    test::add_rectangle(scene, {5, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);    // dark
    test::add_rectangle(scene, {6, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    test::add_polygon(scene, {{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}, lamp);
    test::add_polygon(scene, {{1, 0, 5}, {3, -2, 5}, {3, 3, 5}, {1, 1, 5}}, lamp);  // an arrow with it
    CHECK(join_facets(scene) == 0);
    CHECK(scene.surfaces.size() == 8);
  }
}
