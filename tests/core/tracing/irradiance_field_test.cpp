#include "core/tracing/irradiance_field.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "core/base/random.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// Single-precision storage of values and weights.
constexpr double float_noise = 3e-6;

struct Floor {
  Scene scene;
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const FieldGeometry> geometry;
  void finish(double element_size, double patch_size = 0) {
    MeshOptions options;
    options.element_size = element_size;
    options.patch_size = patch_size;
    mesh = std::make_shared<Mesh>(mesh_of(scene, options, {}));
    geometry = std::make_shared<FieldGeometry>(scene, mesh);
  }
  IrradianceField field(const std::function<Rgb(const Vec3&)>& function) const {
    return IrradianceField(geometry, values_on(*mesh, function));
  }
};

Rgb linear(const Vec3& p) { return {5 + 0.3 * p.x - 0.2 * p.y, 4 + 0.1 * p.x + 0.15 * p.y, 3}; }

Vec3 inside(const Polygon& triangle, Random& random) {
  const double s = std::sqrt(random.unit()), t = random.unit();
  return triangle[0] + s * ((1 - t) * (triangle[1] - triangle[0]) + t * (triangle[2] - triangle[0]));
}

}  // namespace

TEST_CASE("irradiance_field: a linear field is exact everywhere, at the rim too") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  add_rectangle(floor.scene, {0, 0, 0}, {6, 0, 0}, {0, 4, 0}, grey);
  add_rectangle(floor.scene, {6, 0, 0}, {2.3, 0, 0}, {0, 3.1, 0}, grey);  // coplanar, of its own element sizes
  floor.finish(0.27);
  const IrradianceField field = floor.field(linear);
  Random random(1);
  double worst = 0;
  for (int i = 0; i < 4000; ++i) {
    const bool first = i % 2;
    const Vec3 p =
        first ? Vec3{6 * random.unit(), 4 * random.unit(), 0} : Vec3{6 + 2.3 * random.unit(), 3.1 * random.unit(), 0};
    const Rgb error = field.at(SurfaceId{first ? 0u : 1u}, false, p) - linear(p);
    worst = std::max({worst, std::abs(error.x), std::abs(error.y), std::abs(error.z)});
  }
  CHECK(worst < 5 * float_noise);
}

TEST_CASE("irradiance_field: a linear field is exact on elements of all sizes") {
  Floor floor;
  add_rectangle(floor.scene, {0, 0, 0}, {6, 0, 0}, {0, 4, 0}, add_material(floor.scene, diffuse(0.5)));
  floor.finish(0.3);
  std::vector<PlaceTree> places = places_of(*floor.mesh);
  for (std::size_t p = 0; p < places.size(); ++p) {
    if (p % 3 == 1) places[p].divide({static_cast<int>(p / 3 % 3), 0, 0});
    if (p % 7 == 2) places[p].divide({2, 1, 3});
  }
  floor.mesh = std::make_shared<Mesh>(mesh_of(floor.scene, floor.mesh->options, {}, places));
  floor.geometry = std::make_shared<FieldGeometry>(floor.scene, floor.mesh);
  const IrradianceField field = floor.field(linear);
  Random random(3);
  double worst = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p{6 * random.unit(), 4 * random.unit(), 0};
    const Rgb error = field.at(SurfaceId{0}, false, p) - linear(p);
    worst = std::max({worst, std::abs(error.x), std::abs(error.y), std::abs(error.z)});
    const auto element = floor.geometry->element_at(SurfaceId{0}, false, p);
    REQUIRE(element);
    const Vec2 apart = glm::abs(floor.geometry->centre(*element) - floor.mesh->planes[0].coordinates(p));
    CHECK(glm::all(glm::lessThanEqual(apart, 0.5001 * floor.geometry->size_of(*element))));
  }
  CHECK(worst < 5 * float_noise);
}

TEST_CASE("irradiance_field: a linear field is exact on polygons that cut the elements askew, but for their tips") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  const Polygon triangle{{0, 0, 0}, {5, 1, 0}, {1.5, 4, 0}}, other{{5, 1, 0}, {6, 5, 0}, {1.5, 4, 0}};
  add_polygon(floor.scene, triangle, grey);
  add_polygon(floor.scene, other, grey);
  floor.finish(0.3);
  const IrradianceField field = floor.field(linear);
  Random random(2);
  double worst = 0;
  int exact = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 p = inside(i % 2 ? triangle : other, random);
    const Rgb error = field.at(SurfaceId{i % 2 ? 0u : 1u}, false, p) - linear(p);
    const double largest = std::max({std::abs(error.x), std::abs(error.y), std::abs(error.z)});
    worst = std::max(worst, largest);
    exact += largest < 5 * float_noise;
  }
  // In the sharp tips an element has too few neighbours for a full slope; the field changes by 0.1 per element.
  CHECK(exact > 0.95 * 4000);
  CHECK(worst < 0.03);
}

TEST_CASE("irradiance_field: a needle in a floor harms no look-up") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  add_rectangle(floor.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
  add_polygon(floor.scene, {{1, 1, 0}, {1.01, 1, 0}, {1.005, 1 + 5e-11, 0}}, grey);
  floor.finish(0.25);
  const IrradianceField field = floor.field([](const Vec3&) { return Rgb{2.0}; });
  for (std::uint32_t e = 0; e < floor.mesh->elements.size(); ++e) CHECK(floor.geometry->touching(e).size() < 16);
  CHECK(field.at(SurfaceId{0}, false, {1.3, 1.4, 0}).x == doctest::Approx(2));
}

TEST_CASE("irradiance_field: on a uniform grid it is bilinear interpolation") {
  Floor floor;
  add_rectangle(floor.scene, {0, 0, 0}, {8, 0, 0}, {0, 8, 0}, add_material(floor.scene, diffuse(0.5)));
  floor.finish(0.5, 2);
  const auto bumpy = [](const Vec3& p) { return Rgb{2 + std::sin(p.x) * std::cos(1.3 * p.y)}; };
  const IrradianceField field = floor.field(bumpy);
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const double x = 0.25 + 7.5 * random.unit(), y = 0.25 + 7.5 * random.unit();
    const double x0 = std::floor((x - 0.25) / 0.5) * 0.5 + 0.25, y0 = std::floor((y - 0.25) / 0.5) * 0.5 + 0.25;
    const double fx = (x - x0) / 0.5, fy = (y - y0) / 0.5;
    const double expected = (1 - fy) * ((1 - fx) * bumpy({x0, y0, 0}).x + fx * bumpy({x0 + 0.5, y0, 0}).x) +
                            fy * ((1 - fx) * bumpy({x0, y0 + 0.5, 0}).x + fx * bumpy({x0 + 0.5, y0 + 0.5, 0}).x);
    CHECK(field.at(SurfaceId{0}, false, {x, y, 0}).x == doctest::Approx(expected).epsilon(1e-5));
  }
}

TEST_CASE("irradiance_field: there is no seam between coplanar surfaces, patches and groups") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  add_polygon(floor.scene, {{0, 0, 0}, {3, 0, 0}, {3, 2, 0}}, grey);
  add_polygon(floor.scene, {{0, 0, 0}, {3, 2, 0}, {0, 2, 0}}, grey);
  add_rectangle(floor.scene, {3, 0, 0}, {1.7, 0, 0}, {0, 2, 0}, grey);
  floor.finish(0.21);
  Random noise(4);
  const IrradianceField field = floor.field([&](const Vec3&) { return Rgb{1 + noise.unit()}; });
  // Across the diagonal, across the common edge, and along a line over all patches: steps shrink with the distance.
  const double step = 1e-7;
  for (int i = 1; i < 400; ++i) {
    const double t = i / 400.0;
    const Vec3 on_diagonal{3 * t, 2 * t, 0}, on_edge{3, 2 * t, 0}, across{4.7 * t, 0.37, 0};
    CHECK(field.at(SurfaceId{0}, false, on_diagonal + Vec3{step, -step, 0}).x ==
          doctest::Approx(field.at(SurfaceId{1}, false, on_diagonal - Vec3{step, -step, 0}).x).epsilon(1e-5));
    CHECK(field.at(SurfaceId{0}, false, on_edge - Vec3{step, 0, 0}).x ==
          doctest::Approx(field.at(SurfaceId{2}, false, on_edge + Vec3{step, 0, 0}).x).epsilon(1e-5));
    const SurfaceId under{across.x > 3 ? 2u : 0u};
    if (across.x > 0.6)
      CHECK(field.at(under, false, across + Vec3{step, 0, 0}).x ==
            doctest::Approx(field.at(under, false, across - Vec3{step, 0, 0}).x).epsilon(1e-5));
  }
}

TEST_CASE("irradiance_field: nothing leaks across a wall that stands on a slab") {
  for (const double thickness : {0.0, 0.004, 0.12}) {
    CAPTURE(thickness);
    Floor floor;
    const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
    add_rectangle(floor.scene, {0, 0, 0}, {6, 0, 0}, {0, 3, 0}, grey);  // one polygon under both rooms
    const double x = 2.9;                                               // inside a row of elements
    add_rectangle(floor.scene, {x, 0, 0}, {0, 3, 0}, {0, 0, 2}, grey);
    if (thickness > 0) add_rectangle(floor.scene, {x + thickness, 0, 0}, {0, 0, 2}, {0, 3, 0}, grey);
    floor.finish(0.25);
    // Left room bright, right room dim, nothing inside the wall.
    const IrradianceField field = floor.field([&](const Vec3& p) {
      if (p.z > 0) return Rgb{0.0};
      return p.x < x ? Rgb{10.0} : p.x > x + thickness ? Rgb{1.0} : Rgb{0.0};
    });
    Random random(5);
    for (int i = 0; i < 1000; ++i) {
      const double y = 0.01 + 2.98 * random.unit(), d = 0.5 * random.unit() + 1e-5;
      CHECK(field.at(SurfaceId{0}, false, {x - d, y, 0}).x == doctest::Approx(10).epsilon(1e-5));
      CHECK(field.at(SurfaceId{0}, false, {x + thickness + d, y, 0}).x == doctest::Approx(1).epsilon(1e-5));
    }
  }
}

TEST_CASE("irradiance_field: what a box on the floor covers does not darken the floor around it") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  add_rectangle(floor.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
  add_box(floor.scene, {1.03, 1.07, 0}, {2.11, 2.02, 1}, grey, false);
  floor.finish(0.2);
  const auto covered = [](const Vec3& p) { return p.x > 1.03 && p.x < 2.11 && p.y > 1.07 && p.y < 2.02; };
  const IrradianceField field = floor.field([&](const Vec3& p) { return covered(p) ? Rgb{0.0} : Rgb{2.0}; });
  Random random(6);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p{4 * random.unit(), 4 * random.unit(), 0};
    if (!covered(p)) CHECK(field.at(SurfaceId{0}, false, p).x == doctest::Approx(2).epsilon(1e-5));
  }
}

TEST_CASE("irradiance_field: glass standing on a floor separates nothing") {
  Floor floor;
  add_rectangle(floor.scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, add_material(floor.scene, diffuse(0.5)));
  add_rectangle(floor.scene, {2.05, 0, 0}, {0, 4, 0}, {0, 0, 2}, add_material(floor.scene, glass(1.5)));
  floor.finish(0.25);
  const IrradianceField field = floor.field([](const Vec3& p) { return Rgb{1 + p.x * p.x}; });
  const double left = field.at(SurfaceId{0}, false, {2.0499999, 1, 0}).x,
               right = field.at(SurfaceId{0}, false, {2.0500001, 1, 0}).x;
  CHECK(left == doctest::Approx(right).epsilon(1e-5));
}

TEST_CASE("irradiance_field: values are never negative and stay near those of the neighbours") {
  Floor floor;
  add_rectangle(floor.scene, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}, add_material(floor.scene, diffuse(0.5)));
  floor.finish(0.25);
  const IrradianceField field = floor.field([](const Vec3& p) { return Rgb{p.x < 0.5 ? 0.0 : 10.0}; });
  for (int i = 0; i < 300; ++i) {
    const double value = field.at(SurfaceId{0}, false, {i * 0.01, 1.3, 0}).x;
    CHECK(value >= 0);
    CHECK(value <= 15.0001);
  }
}

TEST_CASE("irradiance_field: a side without patches is dark, the element under a point is found") {
  Floor floor;
  const std::uint32_t grey = add_material(floor.scene, diffuse(0.5));
  add_rectangle(floor.scene, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, grey);
  MeshOptions options;
  options.element_size = 0.2;
  const std::vector<LitSides> front_only{{true, false}};
  floor.mesh = std::make_shared<Mesh>(mesh_of(floor.scene, options, front_only));
  floor.geometry = std::make_shared<FieldGeometry>(floor.scene, floor.mesh);
  const IrradianceField field = floor.field([](const Vec3&) { return Rgb{1.0}; });
  CHECK(field.at(SurfaceId{0}, true, {1, 1, 0}) == Rgb{0.0});
  CHECK_FALSE(floor.geometry->element_at(SurfaceId{0}, true, {1, 1, 0}));
  Random random(7);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p{2 * random.unit(), 2 * random.unit(), 0};
    const auto element = floor.geometry->element_at(SurfaceId{0}, false, p);
    REQUIRE(element);
    const Vec2 d = glm::abs(floor.geometry->centre(*element) - floor.mesh->planes[0].coordinates(p));
    const Vec2 half = 0.5 * floor.geometry->size_of(*element) + 1e-9;
    CHECK((d.x <= half.x && d.y <= half.y));
  }
}
