#include "core/light/visibility_cache.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/support/one_cell.hpp"
#include "tests/support/two_rooms.hpp"

using namespace lichthof;

namespace {

VisibilityAnswers answers_of(std::size_t words) {
  const std::vector<std::uint16_t> part(words, 1);
  return VisibilityAnswers(std::span(&part, 1));
}

test::OneCell rooms(std::size_t cache_bytes, unsigned threads = 1) {
  const auto scene = test::two_rooms();
  TransferOptions options;
  options.visibility_cache_bytes = cache_bytes;
  return test::OneCell(scene, test::mesh_with(*scene, 0.5), options, threads);
}

/// The first shots of the strongest groups, each distributed twice as it is.
struct Twice {
  TransferWork first, again;
};
Twice shoot_twice(test::OneCell& cell, int shots) {
  Twice sum;
  const auto add = [](TransferWork& to, const TransferWork& work) {
    to.rays += work.rays, to.rays_saved += work.rays_saved, to.rays_remembered += work.rays_remembered, to.received += work.received;
    to.form_factors += work.form_factors;
  };
  for (int k = 0; k < shots; ++k) {
    const Shot shot = cell.light.take_shot(cell.light.strongest().group, {}, {});
    add(sum.first, cell.light.receive(shot, nullptr));
    add(sum.again, cell.light.receive(shot, nullptr));
  }
  return sum;
}

}  // namespace

TEST_SUITE("visibility_cache") {
  TEST_CASE("visibility_cache: islands get back what was noted for them") {
    const std::vector<std::vector<std::uint16_t>> notes = {{1, 0xffff}, {}, {0, 7, 9}};
    const VisibilityAnswers answers(notes);
    REQUIRE(answers.first.size() == 4);
    for (std::size_t island = 0; island < notes.size(); ++island)
      CHECK(std::ranges::equal(answers.of_island(island), notes[island]));
  }

  TEST_CASE("visibility_cache: kept by group and by what the shot carries, until the memory is spent") {
    VisibilityCache cache(4096);
    const VisibilityCache::Key lamp{GroupId{3}, false, true}, wall{GroupId{3}, true, false}, last{GroupId{4}, true, false};
    CHECK(cache.find(lamp) == nullptr);
    cache.keep(lamp, answers_of(100));
    cache.keep(wall, answers_of(200));
    REQUIRE(cache.find(lamp) != nullptr);
    REQUIRE(cache.find(wall) != nullptr);
    CHECK(cache.find(lamp)->words.size() == 100);
    CHECK(cache.find(wall)->words.size() == 200);
    CHECK(cache.bytes() > 600);
    CHECK(cache.has_room());
    cache.keep(last, answers_of(4000));
    CHECK(cache.find(last) == nullptr);
    CHECK_FALSE(cache.has_room());
    CHECK(cache.find(lamp) != nullptr);
    CHECK(cache.bytes() <= 4096);
  }

  TEST_CASE("visibility_cache: a shot that is repeated brings the same light, bit for bit, without a ray") {
    test::OneCell with = rooms(1 << 24), without = rooms(0), by_three = rooms(1 << 24, 3);
    const Twice known = shoot_twice(with, 40), asked = shoot_twice(without, 40);
    shoot_twice(by_three, 40);
    CHECK(known.again.rays_saved == known.again.rays);
    CHECK(known.again.rays_remembered > 0.5 * static_cast<double>(known.again.rays));
    CHECK(asked.again.rays_remembered == 0);
    CHECK(asked.again.rays_saved < asked.again.rays);
    CHECK(known.again.form_factors < known.first.form_factors);  // packets that see nothing are not computed
    CHECK(known.again.received == asked.again.received);
    const Solution a = with.solution(), b = without.solution(), c = by_three.solution();
    for (std::size_t e = 0; e < a.irradiance.size(); ++e) {
      REQUIRE(a.irradiance[e] == b.irradiance[e]);
      REQUIRE(a.direct_irradiance[e] == b.direct_irradiance[e]);
      REQUIRE(a.irradiance[e] == c.irradiance[e]);
    }
  }

  TEST_CASE("visibility_cache: a solution is the same with it, bit for bit") {
    test::OneCell with = rooms(1 << 24), without = rooms(0);
    with.solve(1e-4);
    without.solve(1e-4);
    CHECK(with.shots == without.shots);
    CHECK(with.light.memory_bytes() > without.light.memory_bytes());
    CHECK(with.solution().irradiance == without.solution().irradiance);
  }
}
