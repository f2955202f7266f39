#include "core/light/near_field.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

struct Uplight {
  double gap, size;  ///< m; below the ceiling
  double turn_deg = 0, scale = 1;
};

/// A closed room of 4 x 4 x 3 m with a lamp near its ceiling that shines up; elements are 12.5 cm wide.
OneCell room_with(const Uplight& lamp) {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, Vec3{0}, lamp.scale * Vec3{4, 4, 3}, add_material(*scene, diffuse(0.7)), true);
  const double turn = lamp.turn_deg * std::numbers::pi / 180, z = 3 - lamp.gap;
  const Vec3 u = lamp.scale * lamp.size * Vec3{std::cos(turn), std::sin(turn), 0},
             v = lamp.scale * lamp.size * Vec3{-std::sin(turn), std::cos(turn), 0};
  add_rectangle(*scene, lamp.scale * Vec3{2, 2, z} - 0.5 * (u + v), u, v, add_material(*scene, luminous(100, 0.5)));
  return {scene, mesh_with(*scene, 0.5 * lamp.scale)};
}

/// Of what luminaires emit, the share that arrives.
double share_of_emission(OneCell& room) {
  for (std::uint32_t g = 0; g < room.mesh->groups.size(); ++g)
    if (room.mesh->patches[room.mesh->groups[g].first_patch].exitance.x > 0)
      room.light.strongest(), room.shoot(GroupId{g});
  return room.received_w.x / room.sent_w.x;
}

/// Of what is emitted in a closed room, what the ledger can't account for when all is shot.
double residual(OneCell& room) {
  room.solve(1e-5);
  const CellPower power = room.light.power();
  return 1 - (power.absorbed.x + power.unshot.x) / power.emitted.x;
}

}  // namespace

TEST_SUITE("near_field") {
  TEST_CASE("near_field: a lamp gives its ceiling what it has, whatever the gap, the size, the turn and the unit") {
    for (const Uplight& lamp : {Uplight{0.001, 1},
                                {0.005, 1},
                                {0.02, 1},
                                {0.05, 1, 27},
                                {0.05, 3},
                                {0.5, 1},
                                {0.001, 0.02, 13},
                                {0.01, 0.02, 13},
                                {0.05, 0.02},
                                {0.03, 0.2, 30},
                                {0.15, 0.2, 30},
                                {0.05, 1, 27, 1e-3},
                                {0.05, 1, 27, 1e3},
                                {0.01, 0.02, 13, 1e3}}) {
      INFO(lamp.gap, " ", lamp.size, " ", lamp.turn_deg, " ", lamp.scale);
      OneCell room = room_with(lamp);
      const double share = share_of_emission(room);
      CHECK(std::abs(share - 1) < 3e-3);  // the worst: 1.6e-3 where the gap is half to one and a half elements
    }
  }

  TEST_CASE("near_field: the ledger of a room that is lit by way of a spot on its ceiling closes") {
    for (const Uplight& lamp : {Uplight{0.001, 1}, {0.02, 1}, {0.05, 1, 27}, {0.03, 0.2, 30}}) {
      INFO(lamp.gap, " ", lamp.size);
      OneCell room = room_with(lamp);
      const double rest = residual(room);
      CHECK(std::abs(rest) < 3e-2);  // the lamp's shadow is a ray a receiver; as points and means: .2 to .5
    }
  }

  TEST_CASE("near_field: plates in contact exchange what lies opposite") {
    // A source of 2 x 1 under a floor of unit squares, a hair away.
    const std::vector<Vec3> corners{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
    FlatSource source;
    source.flat = flat_shooter(corners, {0, 0, 1}, Vec3{0.0});
    const NearPoints points(source, 1e-3f);
    CHECK(points.area() == doctest::Approx(2));
    CHECK(points.packet_count() == NearPoints::most_packets);
    const auto received = [&](const Vec3& corner) {  // A F of the square above, seen from the points
      const std::vector<Vec3> square{corner, corner + Vec3{0, 1, 0}, corner + Vec3{1, 1, 0}, corner + Vec3{1, 0, 0}};
      const FlatShooter outline = flat_shooter(square, {0, 0, -1}, Vec3{0.0});
      const Aim16 aim = places_over(outline);
      Factors16 factors;
      clear_segments(factors.segments);
      double sum = 0;
      for (std::uint32_t k = 0; k < points.packet_count(); ++k) {
        kernels().factor16(points.packet(k), 0xffff, outline, aim, 0, 1e-6f, factors);
        for (const float f : factors.factor) sum += points.share(1) * f;
      }
      return sum;
    };
    const double left = received({0, 0, 1e-3}), right = received({1, 0, 1e-3}), beside = received({2, 0, 1e-3});
    CHECK(left == doctest::Approx(1).epsilon(2e-3));
    CHECK(right == doctest::Approx(1).epsilon(2e-3));
    CHECK(beside < 2e-3);
    CHECK(received({0.25, 0, 1e-3}) == doctest::Approx(1).epsilon(2e-3));
  }
}
