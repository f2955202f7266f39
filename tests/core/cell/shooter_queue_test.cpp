#include "core/cell/shooter_queue.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
ExternalShot external(std::uint64_t sequence, double power_w, std::uint64_t version = 0) {
  auto shot = std::make_shared<Shot>();
  shot->id = {CellId{1}, sequence};
  shot->version = SceneVersion{version};
  ExternalShot waiting;
  waiting.shot = shot;
  waiting.parts = 2;
  waiting.power_w = power_w;
  return waiting;
}
constexpr SceneVersion now{0};
}  // namespace

TEST_SUITE("shooter_queue") {
  TEST_CASE("shooter_queue: the stronger goes first, an external one when both are equal") {
    ShooterQueue queue(100);
    queue.push(external(0, 2));
    CHECK(queue.next(3, 0, now) == NextShooter::local);
    CHECK(queue.next(2, 0, now) == NextShooter::external);
    CHECK(queue.next(1, 0, now) == NextShooter::external);
  }

  TEST_CASE("shooter_queue: a local patch shoots above the threshold only, an external shot always") {
    ShooterQueue queue(100);
    CHECK(queue.next(5, 5, now) == NextShooter::none);
    CHECK(queue.next(5.1, 5, now) == NextShooter::local);
    queue.push(external(0, 0));
    CHECK(queue.next(5, 5, now) == NextShooter::external);
  }

  TEST_CASE("shooter_queue: what waits is counted with its bitmap") {
    ShooterQueue queue(100);
    CHECK(queue.memory_bytes() == 0);
    ExternalShot shot = external(0, 1);
    shot.bitmap = HemicubeBitmap(128);
    queue.push(std::move(shot));
    CHECK(queue.memory_bytes() > pixel_count(128) / 8);
    CHECK(queue.memory_bytes() < pixel_count(128) / 8 + 2000);
    queue.push(external(1, 1));  // without a bitmap
    CHECK(queue.memory_bytes() < pixel_count(128) / 8 + 4000);
    queue.pop_external(now), queue.pop_external(now);
    CHECK(queue.memory_bytes() == 0);
  }

  TEST_CASE("shooter_queue: external shots leave by power, equal ones by number") {
    ShooterQueue queue(100);
    queue.push(external(4, 1));
    queue.push(external(2, 3));
    queue.push(external(3, 1));
    CHECK(queue.parts() == 6);
    for (const std::uint64_t sequence : {2, 3, 4}) CHECK(queue.pop_external(now).shot->id.sequence == sequence);
    CHECK(queue.size() == 0);
  }

  TEST_CASE("shooter_queue: shots of later versions wait, however strong") {
    ShooterQueue queue(100);
    queue.push(external(0, 9, 2));
    CHECK(queue.next(0, 0, now) == NextShooter::none);
    queue.push(external(1, 1, 1));
    CHECK(queue.next(0, 0, SceneVersion{1}) == NextShooter::external);
    CHECK(queue.strongest_external(SceneVersion{1}) == 1);
    CHECK(queue.pop_external(SceneVersion{2}).shot->id.sequence == 0);
  }

  TEST_CASE("shooter_queue: at its limit it lets nothing own shoot until external shots are worked off") {
    ShooterQueue queue(2);
    queue.push(external(0, 1));
    CHECK(queue.next(5, 0, now) == NextShooter::local);
    queue.push(external(1, 1));
    CHECK(queue.next(5, 0, now) == NextShooter::external);
  }
}
