#include "core/light/occluders.hpp"

#include <doctest/doctest.h>

#include <set>

#include "tests/support/hemicube_reference.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

constexpr double offset = 1e-6;
constexpr std::size_t no_limit = 1 << 20;

FlatBox random_box(Random& random, double size) {
  FlatBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = static_cast<float>(2 * random.unit() - 1);
    // Now and then flat, as patches of walls are.
    box.hi[axis] = box.lo[axis] + static_cast<float>(random.below(3) ? size * random.unit() : 0.0);
  }
  return box;
}

Vec3 random_point(Random& random, const FlatBox& box) {
  Vec3 point;
  for (int axis = 0; axis < 3; ++axis) point[axis] = box.lo[axis] + random.unit() * (box.hi[axis] - box.lo[axis]);
  return point;
}

/// A crowd of polygons, some as large as a room, in random order.
Scene crowd(Random& random, int count) {
  Scene scene;
  const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
  for (int k = 0; k < count; ++k)
    test::add_polygon(scene,
                      reference::random_polygon(random, 1.2 * random.unit() * reference::random_unit(random),
                                                random.below(8) ? 0.15 : 1.5, 0.7),
                      grey);
  return scene;
}

/// n x n tiles of the unit square about the origin, as seen along a direction.
Scene tiles(int n, const Vec3& normal) {
  Scene scene;
  const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
  const Vec3 u = glm::normalize(glm::cross(normal, Vec3{0.3, 0.5, 0.8})), v = glm::cross(normal, u);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      test::add_rectangle(scene, (double(i) / n - 0.5) * u + (double(k) / n - 0.5) * v, u / double(n), v / double(n),
                          grey);
  return scene;
}

std::set<std::uint32_t> surfaces_of(const OccluderSelection& selection) {
  std::set<std::uint32_t> found;
  for (const Candidates& some : selection.candidates)
    for (std::uint32_t lane = 0; lane < 16; ++lane)
      if (some.lanes >> lane & 1) REQUIRE(found.insert(selection.blocks[some.block].index[lane]).second);
  return found;
}

}  // namespace

TEST_SUITE("occluders") {
  TEST_CASE("occluders: whatever blocks a segment is in the shaft of its ends [Haines94]") {
    Random random(31);
    std::uint64_t blocked = 0, kept = 0, all = 0;
    for (int trial = 0; trial < 300; ++trial) {
      const int count = trial % 60 ? 1 + static_cast<int>(random.below(400)) : 5000;
      const Scene scene = crowd(random, count);
      const Occluders occluders(scene, scene.surfaces, Vec3{0.0}, offset);
      const Polygon polygon = reference::random_polygon(random, reference::random_unit(random), 0.3, 0.8);
      const FlatShooter shooter = flat_shooter(polygon, glm::normalize(newell_vector(polygon)), Vec3{0.0});
      const FlatBox receivers = random_box(random, 0.5);
      const Shaft shaft = shaft_between(box_of(shooter), receivers, static_cast<float>(offset));
      const std::set<std::uint32_t> found =
          surfaces_of(occluders.in_shaft(shaft, occluders.sides_of(shooter), no_limit));
      kept += found.size(), all += static_cast<std::uint64_t>(count);
      for (int k = 0; k < 40; ++k) {
        double weight = 0;
        Vec3 from{0.0};
        for (const Vec3& corner : polygon) {
          const double w = std::pow(random.unit(), 4);  // corners get their share
          from += w * corner, weight += w;
        }
        from /= weight;
        const Vec3 to = random_point(random, receivers);
        for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s) {
          if (reference::inside_by(from, to, scene.surfaces[s].corners) <= 1e-6) continue;
          REQUIRE(found.count(s) == 1);
          ++blocked;
        }
      }
    }
    CHECK(blocked > 10000);
    CHECK(kept < all / 3);  // and it leaves most of the others out
  }

  TEST_CASE("occluders: every vector width finds the same") {
    Random random(32);
    for (int trial = 0; trial < 200; ++trial) {
      const Scene scene = crowd(random, 60);
      const Occluders occluders(scene, scene.surfaces, Vec3{0.0}, offset);
      const FlatBox everywhere{{-9, -9, -9}, {9, 9, 9}};
      const std::vector<ShooterSides> neither(8);
      const OccluderSelection all = occluders.in_shaft(shaft_between(everywhere, everywhere, 0), neither, no_limit);
      std::vector<ShooterSides> sides(all.blocks.size());
      for (ShooterSides& side : sides) side = {random.bits() & 0xffff, random.bits() & 0xffff};
      const Shaft shaft = shaft_between(random_box(random, 0.4), random_box(random, 0.4), static_cast<float>(offset));
      std::vector<Candidates> first;
      for (const Kernels& k : available_kernels()) {
        std::vector<Candidates> left(all.candidates.size());
        left.resize(k.in_shaft(shaft, all.blocks.data(), sides.data(), all.candidates.data(), all.candidates.size(),
                               left.data()));
        if (&k == &available_kernels()[0]) first = left;
        REQUIRE(left.size() == first.size());
        for (std::size_t i = 0; i < left.size(); ++i) {
          REQUIRE(left[i].block == first[i].block);
          REQUIRE(left[i].lanes == first[i].lanes);
        }
      }
    }
  }

  TEST_CASE("occluders: a surface with shooter and receivers on one side, or in it, is left out") {
    Scene scene;
    const std::uint32_t grey = test::add_material(scene, test::diffuse(0.5));
    test::add_rectangle(scene, {-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, grey);  // the floor itself
    test::add_rectangle(scene, {0, -5, -1}, {0, 10, 0}, {0, 0, 3}, grey);   // a wall between them
    const Occluders occluders(scene, scene.surfaces, Vec3{0.0}, offset);
    const Polygon on_floor{{-2, 0, 0}, {-1, 0, 0}, {-1, 1, 0}, {-2, 1, 0}},
        above{{-2, 0, 2}, {-1, 0, 2}, {-1, 1, 2}, {-2, 1, 2}};
    const FlatBox floor_beyond{{1, 0, 0}, {2, 1, 0}}, floor_here{{-3, 0, 0}, {-2, 1, 0}},
        room_beyond{{1, 0, 0}, {2, 1, 2}};
    const auto found = [&](const Polygon& polygon, const FlatBox& receivers) {
      const FlatShooter shooter = flat_shooter(polygon, {0, 0, 1}, Vec3{0.0});
      return surfaces_of(occluders.in_shaft(shaft_between(box_of(shooter), receivers, static_cast<float>(offset)),
                                            occluders.sides_of(shooter), no_limit));
    };
    CHECK(found(on_floor, room_beyond) == std::set<std::uint32_t>{1});
    CHECK(found(above, floor_beyond) == std::set<std::uint32_t>{1});
    CHECK(found(above, floor_here).empty());
    CHECK(found(on_floor, floor_here).empty());
  }

  TEST_CASE("occluders: what lies in one plane is left out or found as a whole") {
    Random random(34);
    constexpr int along = 70;
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3 normal = trial ? reference::random_unit(random) : Vec3{0, 0, 1};
      const Scene scene = tiles(along, normal);
      const Occluders occluders(scene, scene.surfaces, Vec3{0.0}, offset);
      const Vec3 u = scene.surfaces[0].corners[1] - scene.surfaces[0].corners[0];
      const Vec3 v = scene.surfaces[0].corners[3] - scene.surfaces[0].corners[0];
      const auto found = [&](double lowest, double receivers) {
        const Vec3 corner = -u * double(along) + lowest * normal;  // of a wall that ends there
        const Polygon wall{corner, corner + v, corner + v + normal, corner + normal};
        const FlatShooter shooter = flat_shooter(wall, glm::normalize(u), Vec3{0.0});
        FlatBox box;
        const Vec3 place = 0.3 * u * double(along) + receivers * normal;
        for (int axis = 0; axis < 3; ++axis) box.lo[axis] = box.hi[axis] = static_cast<float>(place[axis]);
        return surfaces_of(occluders.in_shaft(shaft_between(box_of(shooter), box, static_cast<float>(offset)),
                                              occluders.sides_of(shooter), no_limit));
      };
      CAPTURE(trial);
      CHECK(found(0, 0).empty());
      CHECK(found(0.1, 0).empty());
      // The tiles that the way from the wall's lowest line crosses are among them.
      const std::set<std::uint32_t> crossed = found(-0.5, 0.5);
      CHECK(!crossed.empty());
      const Vec3 from = -u * double(along) - 0.5 * normal + 0.5 * v, to = 0.3 * u * double(along) + 0.5 * normal;
      for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s)
        if (reference::inside_by(from, to, scene.surfaces[s].corners) > 1e-6) CHECK(crossed.count(s) == 1);
    }
  }

  TEST_CASE("occluders: more than asked for is none, and said so") {
    Random random(33);
    const Scene scene = crowd(random, 50);
    const Occluders occluders(scene, scene.surfaces, Vec3{0.0}, offset);
    const FlatBox everywhere{{-9, -9, -9}, {9, 9, 9}};
    const std::vector<ShooterSides> neither(8);
    const Shaft shaft = shaft_between(everywhere, everywhere, 0);
    const OccluderSelection whole = occluders.in_shaft(shaft, neither, 50),
                            cut = occluders.in_shaft(shaft, neither, 49);
    CHECK(whole.complete);
    CHECK(surfaces_of(whole).size() == 50);
    CHECK(!cut.complete);
    CHECK(cut.candidates.empty());
  }
}
