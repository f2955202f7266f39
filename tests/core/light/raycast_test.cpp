#include "core/light/raycast.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/hemicube_reference.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

TEST_SUITE("raycast") {
  TEST_CASE("raycast: the nearest surface, its distance and its side") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);  // faces up
    test::add_rectangle(scene, {0, 0, 2}, {1, 0, 0}, {0, 1, 0}, grey);
    const RayScene rays(scene, scene.surfaces, {0.5, 0.5, 1});
    CHECK(rays.surface_count() == 2);
    const auto down = rays.nearest({0.5, 0.5, 3}, {0, 0, -0.5});
    REQUIRE(down);
    CHECK(down->surface == 1);
    CHECK(down->front);
    CHECK(down->distance == doctest::Approx(2));  // in lengths of the direction
    const auto up = rays.nearest({0.2, 0.7, -1}, {0, 0, 1});
    REQUIRE(up);
    CHECK(up->surface == 0);
    CHECK_FALSE(up->front);
    CHECK_FALSE(rays.nearest({0.5, 0.5, 3}, {0, 0, 1}));
    CHECK_FALSE(rays.nearest({0.5, 0.5, 3}, {0, 0, -1}, 0.9));
    CHECK_FALSE(rays.nearest({1.5, 0.5, 3}, {0, 0, -1}));
    CHECK(rays.occluded({0.5, 0.5, 1}, {0.5, 0.5, -1}));
    CHECK_FALSE(rays.occluded({0.5, 0.5, 0.1}, {0.5, 0.5, 1.9}));
  }

  TEST_CASE("raycast: what Embree allocates for a scene is counted, and grows with it") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
    const auto add_floors = [&](int count) {
      for (int i = 0; i < count; ++i) test::add_rectangle(scene, {0, 0, 0.01 * i}, {1, 0, 0}, {0, 1, 0}, grey);
    };
    add_floors(200);
    const std::size_t few = RayScene(scene, scene.surfaces, Vec3{0.0}).memory_bytes();
    add_floors(1800);
    const std::size_t many = RayScene(scene, scene.surfaces, Vec3{0.0}).memory_bytes();
    // Four corners and six numbers of them are 72 bytes; a tree over them may take ten times as much.
    CHECK(few > 200 * 72);
    CHECK(many > 2000 * 72);
    CHECK(many > 5 * few);
    CHECK(many < 2000 * 2000);
  }

  TEST_CASE("raycast: light passes clear glass") {
    Scene scene;
    test::add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, test::glass(1.5)));
    test::add_rectangle(scene, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, test::add_material(scene, test::diffuse(0.5)));
    const RayScene opaque(scene, scene.surfaces, Vec3{0.0}), clear(scene, scene.surfaces, Vec3{0.0}, Glass::clear);
    CHECK(opaque.occluded({0.5, 0.5, 1}, {0.5, 0.5, -0.5}));
    CHECK_FALSE(clear.occluded({0.5, 0.5, 1}, {0.5, 0.5, -0.5}));
    const auto hit = clear.nearest({0.5, 0.5, 1}, {0, 0, -1});
    REQUIRE(hit);
    CHECK(hit->surface == 1);  // numbers stay those of the span
  }

  TEST_CASE("raycast: sixteen segments agree with one at a time, far from the origin too") {
    Random random(3);
    for (const Vec3& far : {Vec3{0.0}, Vec3{1e6, -1e6, 3e5}}) {
      Scene scene;
      const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
      for (int k = 0; k < 30; ++k)
        test::add_polygon(scene, reference::random_polygon(random, far + reference::random_unit(random), 0.5, 0.6),
                          grey);
      const RayScene rays(scene, scene.surfaces, far);
      CHECK(rays.origin() == far);
      CHECK((rays.offset() > 0 && rays.offset() < 1e-4));
      int blocked = 0;
      for (int trial = 0; trial < 100; ++trial) {
        Segments16 segments{};
        clear_segments(segments);
        Vec3 from[16], way[16];
        for (int lane = 0; lane < 16; ++lane) {
          from[lane] = Vec3{Rgbf{random.unit() * reference::random_unit(random)}};
          way[lane] = Vec3{Rgbf{random.unit() * reference::random_unit(random)}};
          segments.ox[lane] = float(from[lane].x), segments.oy[lane] = float(from[lane].y);
          segments.oz[lane] = float(from[lane].z), segments.dx[lane] = float(way[lane].x);
          segments.dy[lane] = float(way[lane].y), segments.dz[lane] = float(way[lane].z);
        }
        RayScene::Hits16 hits;
        rays.nearest16(segments, 0xffff, hits);
        const std::uint32_t active = random.bits() & 0xffff, by_16 = rays.occluded16(segments, active);
        CHECK((by_16 & ~active) == 0);
        for (int lane = 0; lane < 16; ++lane) {
          const auto hit = rays.nearest(far + from[lane], way[lane]);
          if (hit && std::abs(hit->distance - 1) < 1e-4) continue;
          if (active >> lane & 1) {
            REQUIRE(bool(by_16 >> lane & 1) == (hit && hit->distance < 1));
            blocked += hit && hit->distance < 1;
          }
          if (far != Vec3{0.0}) continue;  // world rays are rounded otherwise than local ones there
          REQUIRE((hits.surface[lane] != RayScene::no_surface) == hit.has_value());
          if (!hit) continue;
          REQUIRE(hits.surface[lane] == hit->surface);
          REQUIRE(hits.distance[lane] == doctest::Approx(hit->distance).epsilon(1e-5));
          REQUIRE(bool(hits.front_bits >> lane & 1) == hit->front);
        }
      }
      CHECK(blocked > 50);
    }
  }

  TEST_CASE("raycast: no ray leaves a closed room, edges and corners included") {
    Scene scene;
    test::add_box(scene, {0, 0, 0}, {4, 3, 2.5}, test::add_material(scene, test::diffuse(0.5)), true);
    const RayScene rays(scene, scene.surfaces, bounds(scene).centre(), Glass::clear);
    Random random(5);
    for (int k = 0; k < 20000; ++k) {
      const Vec3 from = Vec3{4, 3, 2.5} * (Vec3{0.5} + 0.9 * (Vec3{random.unit(), random.unit(), random.unit()} - 0.5));
      Vec3 to{4.0 * random.below(2), 3.0 * random.below(2), 2.5 * random.below(2)};
      if (k % 2) to[static_cast<int>(random.below(3))] *= random.unit();
      REQUIRE(rays.nearest(from, to - from));
    }
  }
}
