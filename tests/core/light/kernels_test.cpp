#include "core/light/kernels/kernels.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "core/light/form_factor.hpp"
#include "tests/support/hemicube_reference.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

constexpr float offset = 1e-6f;

Aim16 aim_at_corners(const FlatShooter& f) {
  Aim16 aim;
  for (int i = 0; i < 32; ++i) {
    const int k = i % 16 % f.count;
    aim.x[i] = 0.5f * (f.cx + f.x[k]), aim.y[i] = 0.5f * (f.cy + f.y[k]), aim.z[i] = 0.5f * (f.cz + f.z[k]);
  }
  return aim;
}

void set(Receivers16& r, int lane, const Vec3& point, const Vec3& normal) {
  r.x[lane] = static_cast<float>(point.x), r.y[lane] = static_cast<float>(point.y);
  r.z[lane] = static_cast<float>(point.z);
  r.nx[lane] = static_cast<float>(normal.x), r.ny[lane] = static_cast<float>(normal.y);
  r.nz[lane] = static_cast<float>(normal.z);
}
Vec3 point_of(const Receivers16& r, int lane) { return {r.x[lane], r.y[lane], r.z[lane]}; }
Vec3 normal_of(const Receivers16& r, int lane) { return {r.nx[lane], r.ny[lane], r.nz[lane]}; }

Polygon corners_of(const FlatShooter& f) {
  Polygon corners;
  for (int k = 0; k < f.count; ++k) corners.push_back({f.x[k], f.y[k], f.z[k]});
  return corners;
}

FlatShooter shooter_of(const Polygon& corners) {
  return flat_shooter(corners, glm::normalize(newell_vector(corners)), Vec3{0.0});
}

/// A polygon that stands in the way, with the edges it needs.
struct OccluderOf {
  explicit OccluderOf(const Polygon& corners)
      : flat(flat_occluder(corners, glm::normalize(newell_vector(corners)), Vec3{0.0}, 0, edges)) {
    flat.edges = edges;
  }
  std::vector<OccluderEdge> edges;
  FlatOccluder flat;
};

Factors16 factors_by(const Kernels& kernels, const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter,
                     int turn, std::uint32_t& seen) {
  Factors16 out{};
  clear_segments(out.segments);
  seen = kernels.factor16(receivers, lanes, shooter, aim_at_corners(shooter), turn, offset, out);
  return out;
}

bool same_bits(const float* a, const float* b, std::uint32_t lanes) {
  for (int lane = 0; lane < 16; ++lane)
    if ((lanes >> lane & 1) && std::memcmp(a + lane, b + lane, sizeof(float)) != 0) return false;
  return true;
}

/// All kernels on one input: equal to the last bit.
void expect_same_bits(const Receivers16& receivers, std::uint32_t lanes, const FlatShooter& shooter, int turn) {
  std::uint32_t seen = 0;
  const Factors16 first = factors_by(available_kernels()[0], receivers, lanes, shooter, turn, seen);
  for (const Kernels& kernels : available_kernels().subspan(1)) {
    CAPTURE(kernels.name);
    std::uint32_t seen_too = 0;
    const Factors16 other = factors_by(kernels, receivers, lanes, shooter, turn, seen_too);
    REQUIRE(seen == seen_too);
    REQUIRE(same_bits(first.factor, other.factor, 0xffff));
    REQUIRE(std::memcmp(&first.seen, &other.seen, sizeof first.seen) == 0);
    const Segments16 &s = first.segments, &t = other.segments;
    REQUIRE((same_bits(s.ox, t.ox, seen) && same_bits(s.oy, t.oy, seen) && same_bits(s.oz, t.oz, seen)));
    REQUIRE((same_bits(s.dx, t.dx, seen) && same_bits(s.dy, t.dy, seen) && same_bits(s.dz, t.dz, seen)));
    REQUIRE(same_bits(s.tfar, t.tfar, seen));
  }
}

/// Largest errors of the lanes, relative to the factor face to face at that distance: at a slant the sum cancels.
struct Errors {
  double whole = 0, cut = 0;  ///< of lanes that see the whole polygon, and of those whose horizon cuts it
};
void add_errors(const Receivers16& receivers, const FlatShooter& shooter, Errors& errors) {
  const Polygon corners = corners_of(shooter);
  std::uint32_t seen = 0;
  const Factors16 out = factors_by(kernels(), receivers, 0xffff, shooter, 0, seen);
  for (int lane = 0; lane < 16; ++lane) {
    const Vec3 p = point_of(receivers, lane);
    bool is_cut = false;
    for (const Vec3& c : corners) is_cut |= glm::dot(c - p, normal_of(receivers, lane)) < 0;
    double& worst = is_cut ? errors.cut : errors.whole;
    const double exact = form_factor(p, normal_of(receivers, lane), corners);
    const Vec3 n = glm::normalize(newell_vector(corners)), centre = centroid(corners);
    const double whole = form_factor(centre + glm::length(p - centre) * n, -n, corners);
    if (whole > 0) worst = std::max(worst, std::abs(out.factor[lane] - exact) / whole);
  }
}

/// Receivers in front of the shooter at about the given distance, looking anywhere.
Receivers16 receivers_around(Random& random, const Polygon& shooter, double distance) {
  Receivers16 r{};
  const Vec3 n = glm::normalize(newell_vector(shooter)), centre = centroid(shooter);
  for (int lane = 0; lane < 16; ++lane) {
    Vec3 direction = reference::random_unit(random);
    if (glm::dot(direction, n) < 0.1) direction = glm::normalize(direction + (0.2 - glm::dot(direction, n)) * n);
    set(r, lane, centre + distance * (0.5 + random.unit()) * direction, reference::random_unit(random));
  }
  return r;
}

}  // namespace

TEST_SUITE("kernels") {
  TEST_CASE("kernels: the narrowest always runs, the widest is the default") {
    REQUIRE(!available_kernels().empty());
    CHECK(std::string(available_kernels()[0].name) == "x86-64-v2");
    bool listed = false;
    for (const Kernels& k : available_kernels()) listed |= std::string(k.name) == kernels().name;
    CHECK(listed);
  }

  TEST_CASE("kernels: every width gives the same bits, for polygons anywhere") {
    Random random(1);
    for (int trial = 0; trial < 4000; ++trial) {
      CAPTURE(trial);
      const double thickness = trial % 4 == 0 ? 1e-4 : 0.6, size = std::pow(10.0, 2 * random.unit() - 1.5);
      const Polygon polygon = reference::random_polygon(random, reference::random_unit(random), size, thickness);
      const Receivers16 r = receivers_around(random, polygon, std::pow(10.0, 3 * random.unit() - 2));
      expect_same_bits(r, random.bits() & 0xffff, shooter_of(polygon), static_cast<int>(random.below(16)));
    }
  }

  TEST_CASE("kernels: every width gives the same bits in a room, where corners lie on horizons") {
    Random random(2);
    // Rectangles of a wall, receivers on floor and walls in steps of a quarter: many heights are 0 exactly.
    for (int trial = 0; trial < 4000; ++trial) {
      CAPTURE(trial);
      const auto quarter = [&] { return 0.25 * random.below(9); };
      const double x = 0.25 * random.below(8), z = 0.25 * random.below(8);
      const Polygon wall{{x, 0, z}, {x, 0, z + 0.25}, {x + 0.25, 0, z + 0.25}, {x + 0.25, 0, z}};
      Receivers16 r{};
      for (int lane = 0; lane < 16; ++lane) {
        const int axis = static_cast<int>(random.below(3));
        Vec3 point{quarter(), quarter(), quarter()}, normal{0.0};
        normal[axis] = random.below(2) ? 1 : -1;
        if (random.below(2)) point[(axis + 1) % 3] += 0.1 * random.unit();
        set(r, lane, point, normal);
      }
      expect_same_bits(r, 0xffff, shooter_of(wall), trial % 16);
    }
  }

  TEST_CASE("kernels: factors are those of the closed form, near and far") {
    // A horizon cuts corners whose places are rounded as the distance is, so those lanes lose digits with it.
    struct Case {
      double distance, whole, cut;
    };
    Random random(3);
    for (const Case& c : {Case{1, 2e-6, 2e-6}, Case{3, 5e-6, 5e-6}, Case{10, 1.5e-5, 2e-5}, Case{66, 1e-4, 5e-4}}) {
      Errors errors;
      for (int trial = 0; trial < 2000; ++trial) {
        const Polygon polygon = reference::random_polygon(random, reference::random_unit(random), 1.0, 0.5);
        add_errors(receivers_around(random, polygon, c.distance), shooter_of(polygon), errors);
      }
      INFO("distance " << c.distance << ", error " << errors.whole << ", cut " << errors.cut);
      CHECK(errors.whole < c.whole);
      CHECK(errors.cut < c.cut);
    }
  }

  TEST_CASE("kernels: beside a common edge the factors stay right, down to 1e-8 m") {
    Random random(5);
    const Polygon wall{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};  // x = 0, seen from +x
    for (const double distance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
      Receivers16 r{};
      for (int lane = 0; lane < 16; ++lane) set(r, lane, {distance, random.unit(), 0}, {0, 0, 1});
      std::uint32_t seen = 0;
      const Factors16 out = factors_by(kernels(), r, 0xffff, shooter_of(wall), 0, seen);
      CHECK(seen == 0xffff);
      CAPTURE(distance);
      for (int lane = 0; lane < 16; ++lane)
        CHECK(std::abs(out.factor[lane] - form_factor(point_of(r, lane), {0, 0, 1}, wall)) < 2e-6);
      for (int turn = 0; turn < 16; ++turn) expect_same_bits(r, 0xffff, shooter_of(wall), turn);
    }
  }

  TEST_CASE("kernels: slivers are finite and as thin as their light") {
    Random random(6);
    for (const double thickness : {1e-2, 1e-4, 1e-6}) {
      double worst = 0;
      for (int trial = 0; trial < 300; ++trial) {
        const Polygon polygon = reference::random_polygon(random, reference::random_unit(random), 1.0, thickness);
        const FlatShooter shooter = shooter_of(polygon);
        const Receivers16 r = receivers_around(random, polygon, 1.0);
        std::uint32_t seen = 0;
        const Factors16 out = factors_by(kernels(), r, 0xffff, shooter, 0, seen);
        for (int lane = 0; lane < 16; ++lane) {
          REQUIRE(std::isfinite(out.factor[lane]));
          const double exact = form_factor(point_of(r, lane), normal_of(r, lane), corners_of(shooter));
          worst = std::max(worst, std::abs(out.factor[lane] - exact));
        }
      }
      CAPTURE(thickness);
      CHECK(worst < 1e-6);  // of 1, the factor of all there is to see
    }
  }

  TEST_CASE("kernels: lanes that hold nothing, look away or stand behind are not seen") {
    const Polygon wall{{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};
    Receivers16 r{};
    for (int lane = 0; lane < 16; ++lane) set(r, lane, {1, 0.5, 0.5}, {-1, 0, 0});
    set(r, 1, {-1, 0.5, 0.5}, {1, 0, 0});   // behind the shooter
    set(r, 2, {1, 0.5, 0.5}, {1, 0, 0});    // looks away
    set(r, 3, {0, 2, 0.5}, {0, -1, 0});     // in its plane
    for (const Kernels& k : available_kernels()) {
      std::uint32_t seen = 0;
      const Factors16 out = factors_by(k, r, 0xff0f, shooter_of(wall), 3, seen);
      CHECK(seen == 0xff01);
      for (int lane = 0; lane < 16; ++lane) {
        CHECK((out.factor[lane] > 0) == bool(seen >> lane & 1));
        CHECK(out.seen.lane[lane] == (seen >> lane & 1 ? -1 : 0));
      }
    }
  }

  TEST_CASE("kernels: what lies in one plane exchanges nothing, however the plane is tilted") {
    Random random(8);
    for (int trial = 0; trial < 1000; ++trial) {
      const Vec3 normal = reference::random_unit(random), centre = 100.0 * reference::random_unit(random);
      Vec3 u, v;
      complete_frame(normal, u, v);
      const double half = 5 + 30 * random.unit();
      const Polygon shooter{centre - half * u - half * v, centre + half * u - half * v, centre + half * u + half * v,
                            centre - half * u + half * v};
      Receivers16 r{};
      for (int lane = 0; lane < 16; ++lane) {
        const Vec3 any = 200.0 * reference::random_unit(random);
        set(r, lane, centre + any - glm::dot(any, normal) * normal, normal);
      }
      Factors16 out{};
      clear_segments(out.segments);
      const FlatShooter flat = flat_shooter(shooter, normal, Vec3{0.0});
      const float lift = 300e-6f;  // as RayScene lifts in a scene of this size
      for (const Kernels& k : available_kernels()) CHECK(k.factor16(r, 0xffff, flat, aim_at_corners(flat), 0, lift, out) == 0);
    }
  }

  TEST_CASE("kernels: segments run from the lifted receiver to a visible point of the shooter") {
    Random random(7);
    for (int trial = 0; trial < 500; ++trial) {
      const Polygon polygon = reference::random_polygon(random, reference::random_unit(random), 1.0, 0.5);
      const FlatShooter shooter = shooter_of(polygon);
      const Receivers16 r = receivers_around(random, polygon, 0.5);
      std::uint32_t seen = 0;
      const Factors16 out = factors_by(kernels(), r, 0xffff, shooter, trial % 16, seen);
      const Segments16& s = out.segments;
      for (int lane = 0; lane < 16; ++lane) {
        if (!(seen >> lane & 1)) continue;
        const Vec3 from{s.ox[lane], s.oy[lane], s.oz[lane]}, way{s.dx[lane], s.dy[lane], s.dz[lane]};
        REQUIRE(glm::length(from - point_of(r, lane) - double(offset) * normal_of(r, lane)) < 1e-6);
        REQUIRE(glm::dot(from + way - point_of(r, lane), normal_of(r, lane)) > -1e-5);
        REQUIRE(reference::inside_by(from, point_of(r, lane) + 1.01 * (from + way - point_of(r, lane)), corners_of(shooter)) > -1e-4);
        REQUIRE(s.tfar[lane] == 1.f);
      }
    }
  }

  TEST_CASE("kernels: accumulate adds where no ray was blocked, in a fixed order") {
    Random random(8);
    for (int trial = 0; trial < 200; ++trial) {
      Factors16 factors{};
      alignas(64) float area[16];
      Sums16 sums;
      const float value[3] = {1.5f, -2.f, static_cast<float>(random.unit())};
      for (int lane = 0; lane < 16; ++lane) {
        factors.factor[lane] = static_cast<float>(random.unit());
        factors.segments.tfar[lane] = random.below(3) ? 1.f : -1.f;
        area[lane] = static_cast<float>(random.unit());
        for (auto& channel : sums.value) channel[lane] = static_cast<float>(random.unit());
      }
      float first_total = 0;
      Factors16 first_factors{};
      Sums16 first_sums;
      for (std::size_t k = 0; k < available_kernels().size(); ++k) {
        Factors16 own = factors;
        Sums16 own_sums = sums;
        const float total = available_kernels()[k].accumulate16(own, area, value, own_sums);
        double expected = 0;
        for (int lane = 0; lane < 16; ++lane) {
          const float f = factors.segments.tfar[lane] >= 0 ? factors.factor[lane] : 0.f;
          REQUIRE(own.factor[lane] == f);
          expected += double(f) * area[lane];
          for (int c = 0; c < 3; ++c) REQUIRE(own_sums.value[c][lane] == sums.value[c][lane] + f * value[c]);
        }
        REQUIRE(total == doctest::Approx(expected).epsilon(1e-6));
        if (k == 0) first_total = total, first_factors = own, first_sums = own_sums;
        REQUIRE(std::memcmp(&total, &first_total, sizeof total) == 0);
        REQUIRE(same_bits(own.factor, first_factors.factor, 0xffff));
        REQUIRE(std::memcmp(&own_sums, &first_sums, sizeof sums) == 0);
      }
    }
  }

  TEST_CASE("kernels: a million arrivals are summed to the last bit [Kahan65]") {
    for (const Kernels& k : available_kernels()) {
      Factors16 factors{};
      Sums16 sums;
      Random random(12);
      double expected = 0;
      std::fill_n(factors.segments.tfar, 16, 1.f);
      for (int arrival = 0; arrival < 1'000'000; ++arrival) {
        const float value[3] = {1.f, 1.f, 1.f}, factor = 1e-3f * static_cast<float>(random.unit());
        std::fill_n(factors.factor, 16, factor);
        k.accumulate16(factors, nullptr, value, sums);
        expected += factor;
      }
      CHECK(sums.value[1][7] == doctest::Approx(expected).epsilon(1e-7));
    }
  }

  TEST_CASE("kernels: one occluder blocks exactly what the ray tracer says it blocks") {
    Random random(9);
    int blocked_in_all = 0, free_in_all = 0;
    for (int trial = 0; trial < 400; ++trial) {
      const Polygon polygon = reference::random_polygon(random, Vec3{0.0}, 1.0, 0.6);
      Scene scene;
      test::add_polygon(scene, polygon, test::add_material(scene, test::diffuse(0.5)));
      const RayScene rays(scene, scene.surfaces, Vec3{0.0});
      const OccluderOf occluder(polygon);
      Segments16 segments{};
      clear_segments(segments);
      Vec3 from[16], to[16];
      for (int lane = 0; lane < 16; ++lane) {
        from[lane] = 1.5 * random.unit() * reference::random_unit(random);
        to[lane] = 1.5 * random.unit() * reference::random_unit(random);
        const Vec3 way = to[lane] - from[lane];
        segments.ox[lane] = float(from[lane].x), segments.oy[lane] = float(from[lane].y), segments.oz[lane] = float(from[lane].z);
        segments.dx[lane] = float(way.x), segments.dy[lane] = float(way.y), segments.dz[lane] = float(way.z);
        segments.tfar[lane] = 1.f;
      }
      const std::uint32_t lanes = random.bits() & 0xffff;
      Segments16 traced = segments;
      const std::uint32_t by_rays = rays.occluded16(traced, lanes);
      std::uint32_t first = 0;
      for (const Kernels& k : available_kernels()) {
        Segments16 own = segments;
        LaneMask16 active;
        for (int lane = 0; lane < 16; ++lane) active.lane[lane] = lanes >> lane & 1 ? -1 : 0;
        const bool left = k.block16(occluder.flat, own, active);
        std::uint32_t blocked = 0;
        bool any_left = false;
        for (int lane = 0; lane < 16; ++lane) {
          const bool held = lanes >> lane & 1, is_blocked = held && own.tfar[lane] < 0;
          REQUIRE(active.lane[lane] == (held && !is_blocked ? -1 : 0));
          any_left |= active.lane[lane] != 0;
          blocked |= std::uint32_t{is_blocked} << lane;
          const double by = reference::inside_by(from[lane], to[lane], polygon);
          if (!held || std::abs(by) < 1e-4) continue;  // rounding may decide
          REQUIRE(is_blocked == (by > 0));
          REQUIRE(bool(by_rays >> lane & 1) == (by > 0));
          ++(is_blocked ? blocked_in_all : free_in_all);
        }
        REQUIRE(left == any_left);
        if (&k == &available_kernels()[0]) first = blocked;
        REQUIRE(blocked == first);
      }
    }
    CHECK(blocked_in_all > 300);
    CHECK(free_in_all > 300);
  }

  TEST_CASE("kernels: a box is hidden only if no segment from the shooter reaches it") {
    Random random(10);
    int hidden_count = 0;
    for (int trial = 0; trial < 20000; ++trial) {
      const Polygon shooter = reference::random_polygon(random, {0, 0, 1}, 0.4 * random.unit() + 0.01, 0.6);
      const Polygon occluder = reference::random_polygon(random, 0.3 * reference::random_unit(random), 1.0, 0.8);
      const Vec3 lo = Vec3{0, 0, -1} + 0.6 * (Vec3{random.unit(), random.unit(), random.unit()} - 0.5);
      const Vec3 hi = lo + 0.4 * Vec3{random.unit(), random.unit(), random.unit()};
      alignas(32) float box[3][8];
      for (int k = 0; k < 8; ++k)
        for (int axis = 0; axis < 3; ++axis) box[axis][k] = static_cast<float>(k >> axis & 1 ? hi[axis] : lo[axis]);
      const bool hidden = available_kernels()[0].hidden8(box, shooter_of(shooter), OccluderOf(occluder).flat, 1e-5f);
      for (const Kernels& k : available_kernels().subspan(1))
        REQUIRE(k.hidden8(box, shooter_of(shooter), OccluderOf(occluder).flat, 1e-5f) == hidden);
      if (!hidden) continue;
      ++hidden_count;
      for (int k = 0; k < 200; ++k) {
        Vec3 from{0.0};
        double weight = 0;
        for (const Vec3& p : shooter) {
          const double w = std::pow(random.unit(), 6);  // corners get their share
          from += w * p, weight += w;
        }
        Vec3 to;
        for (int axis = 0; axis < 3; ++axis) {
          const double t = std::clamp(1.4 * random.unit() - 0.2, 0.0, 1.0);
          to[axis] = lo[axis] + t * (hi[axis] - lo[axis]);
        }
        REQUIRE(reference::inside_by(from / weight, to, occluder) > -1e-6);
      }
    }
    CHECK(hidden_count > 300);
  }

  TEST_CASE("kernels: what lies in the shooter's plane hides nothing") {
    const Polygon shooter{{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};
    alignas(32) float box[3][8];
    const Vec3 lo{-0.1, -0.1, 1}, hi{0.1, 0.1, 1.1};
    for (int k = 0; k < 8; ++k)
      for (int axis = 0; axis < 3; ++axis) box[axis][k] = static_cast<float>(k >> axis & 1 ? hi[axis] : lo[axis]);
    for (const double height : {0.0, 5e-6, 2e-5, 0.5, 0.999}) {
      const Polygon occluder{{-2, -2, height}, {2, -2, height}, {2, 2, height}, {-2, 2, height}};
      const Polygon turned(occluder.rbegin(), occluder.rend());
      CAPTURE(height);
      for (const Kernels& k : available_kernels()) {
        CHECK(k.hidden8(box, shooter_of(shooter), OccluderOf(occluder).flat, 1e-5f) == (height > 1e-5));
        CHECK(k.hidden8(box, shooter_of(shooter), OccluderOf(turned).flat, 1e-5f) == (height > 1e-5));
      }
    }
  }
}
