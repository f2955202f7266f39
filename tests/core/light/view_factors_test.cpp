#include "core/light/view_factors.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "tests/support/rooms.hpp"
#include "tests/support/view_factor_references.hpp"

using namespace lichthof;

namespace {

std::vector<ViewSide> fronts(const Scene& scene) {
  std::vector<ViewSide> sides;
  for (std::uint32_t i = 0; i < scene.surfaces.size(); ++i) sides.push_back({i, false, i});
  return sides;
}

ViewFactors factors_of(const Scene& scene, const ViewFactorOptions& options = {}, unsigned threads = 1) {
  const std::vector<ViewSide> sides = fronts(scene);
  return view_factors(scene, sides, static_cast<std::uint32_t>(sides.size()), options, Parallel(threads));
}

/// A closed room with a closed box that floats in it: faces 0-5 and 6-11.
Scene furnished_room() {
  Scene scene;
  test::add_material(scene, test::diffuse(0.5));
  test::add_box(scene, {0, 0, 0}, {3, 2, 2}, 0, true);
  test::add_box(scene, {1, 0.5, 0.4}, {1.7, 1.2, 1.1}, 0, false);
  return scene;
}

Scene plates_with(double side) {
  Scene scene;
  test::add_material(scene, test::diffuse(0.5));
  test::add_polygon(scene, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0);
  test::add_polygon(scene, {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, 0);
  const double lo = 0.5 - 0.5 * side, hi = 0.5 + 0.5 * side;
  test::add_polygon(scene, {{lo, lo, 0.5}, {hi, lo, 0.5}, {hi, hi, 0.5}, {lo, hi, 0.5}}, 0);
  return scene;
}

/// A strip above two walls, with a gap between them beside which a plate lies: what the strip sees of it, it sees through the gap.
Scene strip_over_gap(double length, double width, double lift, double from, double to, double reach, double tiles) {
  Scene scene;
  test::add_material(scene, test::diffuse(0.5));
  test::add_polygon(scene, {{0, from, 0}, {0, to, 0}, {-reach, to, 0}, {-reach, from, 0}}, 0);
  test::add_polygon(scene, {{0, -length, 0}, {0, from, 0}, {0, from, lift}, {0, -length, lift}}, 0);
  test::add_polygon(scene, {{0, to, 0}, {0, 2 * length, 0}, {0, 2 * length, lift}, {0, to, lift}}, 0);
  for (int k = 0; k < tiles; ++k) {
    const double lo = length * k / tiles, hi = length * (k + 1) / tiles;
    test::add_polygon(scene, {{width, lo, lift}, {0, lo, lift}, {0, hi, lift}, {width, hi, lift}}, 0);
  }
  return scene;
}

}  // namespace

TEST_SUITE("view_factors") {
  TEST_CASE("view_factors: the faces of a cube have the closed forms, and rows sum to 1") {
    Scene scene;
    test::add_box(scene, {0, 0, 0}, {1, 1, 1}, test::add_material(scene, test::diffuse(0.5)), true);
    const ViewFactors f = factors_of(scene);
    REQUIRE(f.count == 6);
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) {
        const double exact = i == j           ? 0
                             : i / 2 == j / 2 ? reference::parallel_plates(1, 1)
                                              : reference::perpendicular_exchange(1, 1);
        CHECK(std::abs(f.factor(i, j) - exact) < 1e-10);  // exchange_area's promise
      }
      CHECK(std::abs(f.row_sum(i) - 1) < 1e-9);
    }
    CHECK(f.pairs_facing == 15);
    CHECK(f.pairs_obstructed == 0);
    CHECK(f.pairs_both_ways == 15);
    CHECK(f.pairs_disagreeing == 0);
    CHECK(f.reciprocity_defect < 1e-6);
  }

  TEST_CASE("view_factors: a plate between plates hides what its integral says, to 1e-6") {
    for (const double side : {0.3, 0.5, 0.8}) {
      const ViewFactors f = factors_of(plates_with(side));
      const double exact = reference::parallel_plates(1, 1) - reference::hidden_by_square_between_plates(side);
      CAPTURE(side);
      CHECK(std::abs(f.factor(0, 1) - exact) < 1e-6);
      CHECK(std::abs(f.factor(0, 1) - exact) <= f.error(0, 1));
      CHECK(f.factor(0, 1) == f.factor(1, 0));
      CHECK(f.factor(0, 2) == 0);  // the plate's back: it has no row
      CHECK(f.pairs_obstructed == 1);
      CHECK(f.pairs_disagreeing == 0);
    }
  }

  TEST_CASE("view_factors: in a closed room with a box every row sums to 1 within its errors") {
    const Scene scene = furnished_room();
    for (const double tolerance : {1e-4, 1e-6}) {
      const ViewFactors f = factors_of(scene, {.tolerance = tolerance});
      CHECK(f.pairs_inexact == 0);
      CHECK(f.reciprocity_defect < 2 * tolerance);
      // Estimates from few points are no bounds: only the fine run's are asked to cover every pair.
      CHECK((tolerance > 1e-6 || f.pairs_disagreeing == 0));
      for (std::size_t i = 0; i < f.count; ++i) {
        double error = 1e-9;
        for (std::size_t j = 0; j < f.count; ++j) error += f.error(i, j);
        CAPTURE(i);
        CAPTURE(tolerance);
        CHECK(std::abs(f.row_sum(i) - 1) <= error);
        CHECK(error < 12 * tolerance);
      }
    }
  }

  TEST_CASE("view_factors: figures do not depend on the number of threads") {
    const Scene scene = furnished_room();
    const ViewFactors one = factors_of(scene, {.tolerance = 1e-4}, 1),
                      three = factors_of(scene, {.tolerance = 1e-4}, 3);
    CHECK(one.exchange == three.exchange);
    CHECK(one.errors == three.errors);
    CHECK(one.points == three.points);
    CHECK(one.reciprocity_defect == three.reciprocity_defect);
  }

  TEST_CASE("view_factors: groups add their sides up, and may see themselves") {
    const Scene scene = furnished_room();
    const ViewFactors apart = factors_of(scene, {.tolerance = 1e-4});
    std::vector<ViewSide> sides = fronts(scene);
    for (ViewSide& side : sides) side.group = side.surface < 6 ? 0 : 1;
    const ViewFactors f = view_factors(scene, sides, 2, {.tolerance = 1e-4}, Parallel(1));
    double to_box = 0;
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = 6; j < 12; ++j) to_box += apart.exchange[i * 12 + j];
    CHECK(f.areas[0] == doctest::Approx(32));
    CHECK(f.factor(0, 1) == doctest::Approx(to_box / 32).epsilon(1e-12));
    // A convex body sees only the room, whatever stands where.
    CHECK(f.factor(1, 1) == 0);
    CHECK(std::abs(f.factor(1, 0) - 1) < 6e-4);
    CHECK(std::abs(f.factor(0, 0) + f.factor(0, 1) - 1) < 12e-4);
  }

  TEST_CASE("view_factors: backs see what is behind, planes never themselves") {
    const Scene scene = plates_with(0.5);
    std::vector<ViewSide> sides;
    for (std::uint32_t i = 0; i < 3; ++i) sides.push_back({i, false, 2 * i}), sides.push_back({i, true, 2 * i + 1});
    const ViewFactors f = view_factors(scene, sides, 6, {}, Parallel(1));
    CHECK(f.factor(4, 2) > 0);                                 // up, to the ceiling
    CHECK(std::abs(f.factor(5, 0) - f.factor(4, 2)) < 1e-10);  // down, to the floor: the same
    CHECK(f.factor(4, 0) == 0);
    CHECK(f.factor(4, 5) == 0);
    for (const std::size_t outside : {1, 3}) CHECK(f.row_sum(outside) == 0);
  }

  TEST_CASE("view_factors: tilting, moving and scaling a scene changes nothing") {
    const Scene scene = plates_with(0.5);
    const ViewFactors straight = factors_of(scene);
    Scene moved = scene;
    const Vec3 x = glm::normalize(Vec3{2, 1, 2}), y = glm::normalize(glm::cross(Vec3{0, 0, 1}, x)),
               z = glm::cross(x, y);
    for (Surface& surface : moved.surfaces) {
      for (Vec3& p : surface.corners) p = 7.0 * (p.x * x + p.y * y + p.z * z) + Vec3{100, -50, 20};
      surface.normal = glm::normalize(newell_vector(surface.corners));
      surface.area = area(surface.corners);
    }
    const ViewFactors tilted = factors_of(moved);
    CHECK(std::abs(tilted.factor(0, 1) - straight.factor(0, 1)) < 2e-6);  // each within its tolerance
    CHECK(std::abs(tilted.factor(1, 0) - straight.factor(1, 0)) < 2e-6);
  }

  TEST_CASE("view_factors: a gap that no point of the first rule looks through is found") {
    struct Gap {
      double length, from, to, reach, tolerance, scale;
    };
    for (const Gap gap :
         {Gap{33, 20, 23, 20, 1e-3, 1}, Gap{33, 20, 23, 20, 1e-4, 1e-3}, Gap{2500, 1000, 1008, 250, 1e-6, 1},
          Gap{2500, 1700, 1700.5, 250, 1e-7, 1}, Gap{250, 100, 100.3, 25, 1e-6, 1000}}) {
      Scene whole = strip_over_gap(gap.length, 1.25, 0.5, gap.from, gap.to, gap.reach, 1),
            tiles = strip_over_gap(gap.length, 1.25, 0.5, gap.from, gap.to, gap.reach, 50);
      for (Scene* scene : {&whole, &tiles})
        for (Surface& surface : scene->surfaces) {
          for (Vec3& p : surface.corners) p *= gap.scale;
          surface.area *= gap.scale * gap.scale;
        }
      const ViewFactors f = factors_of(whole, {.tolerance = gap.tolerance}),
                        g = factors_of(tiles, {.tolerance = 0.1 * gap.tolerance});
      double in_tiles = 0;
      for (std::size_t k = 3; k < g.count; ++k) in_tiles += g.exchange[k];
      CAPTURE(gap.length);
      CAPTURE(gap.tolerance);
      CAPTURE(f.exchange[3]);
      CAPTURE(in_tiles);
      const double smaller = std::min(f.areas[0], f.areas[3]);
      CHECK(in_tiles > 3 * gap.tolerance * smaller);
      CHECK(std::abs(f.exchange[3] - in_tiles) < 1.2 * gap.tolerance * smaller);
      CHECK(f.errors[3] <= gap.tolerance * smaller);
    }
  }

  TEST_CASE("view_factors: slivers at right angles to a plate have the closed form") {
    for (const double width : {1e-1, 1e-3, 1e-5})
      for (const double length : {10.0, 1e4}) {
        Scene scene;
        test::add_material(scene, test::diffuse(0.5));
        test::add_polygon(scene, {{0, 0, 0}, {1, 0, 0}, {1, length, 0}, {0, length, 0}}, 0);
        test::add_polygon(scene, {{0, 0, 0}, {0, length, 0}, {0, length, width}, {0, 0, width}}, 0);
        const ViewFactors f = factors_of(scene);
        const double exact = length * length * reference::perpendicular_exchange(1 / length, width / length);
        CAPTURE(width);
        CAPTURE(length);
        CAPTURE(f.exchange[1] / exact);
        CHECK(std::abs(f.factor(1, 0) - exact / (width * length)) < 1e-6);
      }
  }

  TEST_CASE("view_factors: solids hide what their faces hide") {
    const Scene closed = furnished_room();
    Scene apart = closed;
    // A face that a corner more keeps from joining the others hides the same.
    Surface& face = apart.surfaces[6];
    face.corners.insert(face.corners.begin() + 1, 0.5 * (face.corners[0] + face.corners[1]));
    const ViewFactors a = factors_of(closed, {.tolerance = 1e-5}), b = factors_of(apart, {.tolerance = 1e-5});
    for (std::size_t k = 0; k < a.exchange.size(); ++k)
      CHECK(std::abs(a.exchange[k] - b.exchange[k]) <= a.errors[k] + b.errors[k] + 1e-9);
  }

  TEST_CASE("view_factors: rows that are asked for are those of the whole matrix") {
    const Scene scene = furnished_room();
    const ViewFactors whole = factors_of(scene, {.tolerance = 1e-4});
    ViewFactorOptions options{.tolerance = 1e-4};
    options.rows.assign(12, 0), options.rows[7] = 1;
    const ViewFactors f = factors_of(scene, options);
    for (std::size_t j = 0; j < 12; ++j) CHECK(f.exchange[7 * 12 + j] == whole.exchange[7 * 12 + j]);
    CHECK(f.pairs_facing < whole.pairs_facing / 2);
    CHECK(f.pairs_missing == 0);
  }

  TEST_CASE("view_factors: a stop leaves what was not reached unknown") {
    const std::atomic<bool> stop{true};
    ViewFactorOptions options;
    options.stop = &stop;
    const ViewFactors f = factors_of(furnished_room(), options);
    CHECK(f.pairs_missing == factors_of(furnished_room(), {.tolerance = 0.1}).pairs_facing);
    CHECK(std::isnan(f.factor(0, 1)));
    CHECK(f.factor(0, 0) == 0);
    CHECK(f.areas[0] > 0);
  }
}
