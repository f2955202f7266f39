#include "core/cell/cell.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "core/cell/cell_invariants.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;

namespace {

constexpr Epoch epoch{3};

CellOptions options() {
  CellOptions options;
  options.hemicube_resolution = 16;
  options.epoch = epoch;
  return options;
}

/// Three cells in a row, a lamp in the first that shines along the row, a dark patch facing it in each of the others.
test::ToyWorld row() {
  test::ToyWorld world = test::toy_world({3, 1, 1}, 0, 1);
  for (std::uint32_t c = 0; c < 3; ++c) {
    test::ToyPatch patch;
    patch.centre = {c + 0.5, 0.5, 0.5};
    patch.normal = {c == 0 ? 1.0 : -1.0, 0, 0};
    patch.area = 0.0625;
    patch.emission = Rgb{c == 0 ? 1.0 : 0.0};
    patch.reflectance = Rgb{0.5};
    patch.material = c;
    world.patches[c].push_back(patch);
  }
  return world;
}

Cell cell_of(const test::ToyWorld& world, std::uint32_t c) {
  return Cell(CellId{c}, world.grid, std::make_unique<test::ToyLight>(world, CellId{c}), options());
}

template <class Message>
std::vector<Message> sent(const Effects& effects) {
  std::vector<Message> found;
  for (const Envelope& envelope : effects.outbox)
    if (const auto* message = std::get_if<Message>(&envelope.message)) found.push_back(*message);
  return found;
}

template <class E>
std::size_t count(const Effects& effects) {
  return static_cast<std::size_t>(std::count_if(effects.events.begin(), effects.events.end(),
                                                [](const Event& e) { return std::holds_alternative<E>(e); }));
}

void order(Cell& cell, const Message& message) { cell.accept({ToController{}, cell.id(), message}, {}); }

/// Announced, started, and its lamp shot if it has one.
Cell started(const test::ToyWorld& world, std::uint32_t c, double threshold_w = 1e-9) {
  Cell cell = cell_of(world, c);
  cell.step({});
  order(cell, StartRadiosity{epoch, threshold_w});
  return cell;
}

/// The message the first cell sends to the second.
Envelope lamp_shot(const test::ToyWorld& world) {
  Cell first = started(world, 0);
  const Effects effects = first.step({});
  for (const Envelope& envelope : effects.outbox)
    if (envelope.to == Address{CellId{1}}) return envelope;
  FAIL("the lamp did not shoot");
  return {};
}

}  // namespace

TEST_SUITE("cell") {
  TEST_CASE("cell: its first step announces it with its largest initial power") {
    const test::ToyWorld world = row();
    Cell cell = cell_of(world, 0);
    REQUIRE(cell.has_work());
    const auto ready = sent<CellReady>(cell.step({}));
    REQUIRE(ready.size() == 1);
    CHECK(ready[0].largest_initial_power_w == doctest::Approx(3 * 0.0625));
    CHECK(!cell.has_work());  // it rests until it is started
  }

  TEST_CASE("cell: falling idle is reported once, and again after each new work") {
    const test::ToyWorld world = row();
    Cell cell = started(world, 1);
    const Effects effects = cell.step({});
    REQUIRE(sent<CellReport>(effects).size() == 1);
    CHECK(sent<CellReport>(effects)[0].idle);
    CHECK(sent<CellReport>(effects)[0].wave == 0);
    CHECK(count<CellIdle>(effects) == 1);
    CHECK(!cell.has_work());

    cell.accept(lamp_shot(world), {});
    std::size_t reports = 0;
    while (cell.has_work()) reports += sent<CellReport>(cell.step({})).size();
    CHECK(reports == 1);
  }

  TEST_CASE("cell: a poll is answered in the next step, busy or idle, with counts that include that step") {
    const test::ToyWorld world = row();
    Cell cell = started(world, 0);
    order(cell, PollCell{epoch, 7});
    const auto reports = sent<CellReport>(cell.step({}));
    REQUIRE(!reports.empty());
    CHECK(reports[0].wave == 7);
    CHECK(reports[0].messages_sent == 1);
    CHECK(reports[0].shots == 1);
    order(cell, PollCell{Epoch{2}, 8});  // of an older epoch: dropped
    while (cell.has_work()) CHECK(sent<CellReport>(cell.step({})).size() <= 1);
  }

  TEST_CASE("cell: a stopped cell files light but does nothing; started again it goes on") {
    const test::ToyWorld world = row();
    Cell cell = started(world, 1);
    cell.step({});
    order(cell, StopRadiosity{epoch});
    cell.accept(lamp_shot(world), {});
    CHECK(!cell.has_work());
    CHECK(cell.state().queued_parts == 1);
    order(cell, StartRadiosity{epoch, 1e-9});
    REQUIRE(cell.has_work());
    CHECK(count<ShotFired>(cell.step({})) == 1);
  }

  TEST_CASE("cell: with an infinite threshold it finishes external shots and shoots none of its own") {
    const test::ToyWorld world = row();
    Cell cell = started(world, 1, std::numeric_limits<double>::infinity());
    cell.accept(lamp_shot(world), {});
    while (cell.has_work()) cell.step({});
    CHECK(cell.state().external_shots == 1);
    CHECK(cell.state().local_shots == 0);
  }

  TEST_CASE("cell: what can not be is refused with an event, counts as processed, and changes nothing") {
    const test::ToyWorld world = row();
    const Envelope good = lamp_shot(world);
    const HemicubeMessage& light = std::get<HemicubeMessage>(good.message);
    const auto with = [&](auto&& edit) {
      auto shot = std::make_shared<Shot>(*light.shot);
      HemicubeMessage message = light;
      edit(*shot, message);
      message.shot = message.shot ? shot : nullptr;
      return Envelope{message.from, CellId{1}, message};
    };
    const double not_a_number = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Envelope> bad{
        with([](Shot&, HemicubeMessage& m) { m.shot = nullptr; }),
        with([](Shot&, HemicubeMessage& m) { m.from = CellId{2}; }),  // no predecessor
        with([](Shot&, HemicubeMessage& m) { m.from = CellId{77}; }),
        with([](Shot& s, HemicubeMessage&) { s.id.cell = CellId{1}; }),  // our own shot
        with([](Shot& s, HemicubeMessage&) { s.id.cell = CellId{4000}; }),
        with([](Shot& s, HemicubeMessage&) {
          s.plane.normal = {-1, 0, 0};
        }),
        with([](Shot& s, HemicubeMessage&) { s.plane.normal *= 2.0; }),
        with([&](Shot& s, HemicubeMessage&) { s.centre.x = not_a_number; }),
        with([](Shot& s, HemicubeMessage&) { s.centre.x = 2.5; }),  // not in the cell that claims it
        with([](Shot& s, HemicubeMessage&) { s.area = -1; }),
        with([](Shot& s, HemicubeMessage&) { s.radius = 0; }),
        with([](Shot& s, HemicubeMessage&) { s.patches.clear(); }),
        with([](Shot& s, HemicubeMessage&) { s.corners.resize(2); }),
        with([](Shot& s, HemicubeMessage&) { s.patches[0].delta.resize(5); }),
        with([](Shot& s, HemicubeMessage&) { s.patches[0].columns = 200; }),
        with([](Shot& s, HemicubeMessage&) { s.patches[0].delta[0].y = std::numeric_limits<float>::infinity(); }),
        with([](Shot&, HemicubeMessage& m) { m.bitmap.clear(); }),
        with([](Shot&, HemicubeMessage& m) { m.bitmap.resize(m.bitmap.size() / 2); }),
        with([](Shot&, HemicubeMessage& m) { m.bitmap = packed(HemicubeBitmap(32)); }),
        Envelope{CellId{2}, CellId{1}, light},  // another cell posing as the first
        Envelope{ToController{}, CellId{1}, light},
    };
    Cell cell = started(world, 1);
    cell.step({});
    std::size_t refused = 0;
    for (std::size_t k = 0; k < bad.size(); ++k) {
      CAPTURE(k);
      cell.accept(bad[k], {});
      REQUIRE(cell.has_work());
      refused += count<MessageRefused>(cell.step({}));
      CHECK(refused == k + 1);
    }
    CHECK(cell.state().processed == bad.size());
    CHECK(cell.state().external_shots == 0);
    CHECK(static_cast<const test::ToyLight&>(cell.light()).patches()[0].irradiance == Rgb{0.0});
    CHECK(broken_cell_invariant(cell) == "");
    // The genuine one still gets in, once.
    cell.accept(good, {});
    CHECK(count<ShotFired>(cell.step({})) == 1);
    cell.accept(good, {});
    while (cell.has_work()) refused += count<MessageRefused>(cell.step({}));
    CHECK(refused == bad.size() + 1);
    CHECK(cell.state().external_shots == 1);
  }

  TEST_CASE("cell: orders of anyone but the controller, and senseless ones, are refused") {
    const test::ToyWorld world = row();
    Cell cell = cell_of(world, 0);
    cell.step({});
    cell.accept({CellId{1}, CellId{0}, StartRadiosity{epoch, 0}}, {});
    order(cell, StartRadiosity{epoch, std::numeric_limits<double>::quiet_NaN()});
    order(cell, StartRadiosity{epoch, -1});
    order(cell, CellReady{CellId{0}, 1});
    CHECK(!cell.running());
    CHECK(cell.state().refused == 4);
    CHECK(count<MessageRefused>(cell.step({})) == 4);
    order(cell, StartRadiosity{Epoch{2}, 0});  // stale, not wrong
    CHECK(!cell.has_work());
  }

  TEST_CASE("cell: a shot of a later scene version waits until the cell has reached it") {
    const test::ToyWorld world = row();
    Envelope early = lamp_shot(world);
    auto shot = std::make_shared<Shot>(*std::get<HemicubeMessage>(early.message).shot);
    shot->version = SceneVersion{1};
    std::get<HemicubeMessage>(early.message).shot = shot;
    Cell cell = started(world, 1);
    cell.step({});
    cell.accept(early, {});
    while (cell.has_work()) CHECK(count<ShotFired>(cell.step({})) == 0);
    CHECK(cell.state().queued_parts == 1);
    order(cell, GeometryChange{SceneVersion{1}, SetEmission{7, Rgb{1.0}}});
    CHECK(count<ChangeApplied>(cell.step({})) == 1);
    CHECK(count<ShotFired>(cell.step({})) == 1);
  }

  TEST_CASE("cell: its shots carry the version they were taken at") {
    const test::ToyWorld world = row();
    Cell cell = started(world, 0);
    order(cell, GeometryChange{SceneVersion{1}, SetEmission{0, Rgb{2.0}}});
    cell.step({});
    const auto light = sent<HemicubeMessage>(cell.step({}));
    REQUIRE(light.size() == 1);
    CHECK(light[0].shot->version == SceneVersion{1});
    CHECK(light[0].shot->patches[0].delta[0].x == doctest::Approx(2 * std::numbers::pi));
  }

  TEST_CASE("cell: a closed mark is passed on without light, projection or bitmap, and joins count on it") {
    const test::ToyWorld world = row();
    Envelope closed = lamp_shot(world);
    std::get<HemicubeMessage>(closed.message).closed = true;
    std::get<HemicubeMessage>(closed.message).bitmap.clear();
    Cell cell = started(world, 1);
    cell.accept(closed, {});
    const Effects effects = cell.step({});
    CHECK(count<VisitSkipped>(effects) == 1);
    CHECK(effects.work.bitmaps_projected == 0);
    const auto light = sent<HemicubeMessage>(effects);
    REQUIRE(light.size() == 1);
    CHECK(light[0].closed);
    CHECK(light[0].bitmap.empty());
    CHECK(cell.counters().cells_skipped == 1);
    CHECK(cell.state().processed == 1);
  }

  TEST_CASE("cell: behind a wall that fills its side it sends closed marks, and the covered cell is skipped") {
    test::ToyWorld world = row();
    world.walls[0] = {{{0.9, 0, 0}, {0.9, 1, 0}, {0.9, 1, 1}, {0.9, 0, 1}}};
    const Envelope shot = lamp_shot(world);
    CHECK(std::get<HemicubeMessage>(shot.message).closed);
    // A wall in the last cell does not close the way into it.
    world.walls[0].clear();
    world.walls[2] = {{{2.1, 0, 0}, {2.1, 1, 0}, {2.1, 1, 1}, {2.1, 0, 1}}};
    CHECK(!std::get<HemicubeMessage>(lamp_shot(world).message).closed);
  }

  TEST_CASE("cell: alone in its grid it makes no bitmap and sends no light") {
    const test::ToyWorld world = test::undivided(row());
    Cell cell = started(world, 0);
    while (cell.has_work()) {
      const Effects effects = cell.step({});
      CHECK(sent<HemicubeMessage>(effects).empty());
      CHECK(effects.work.bitmaps_projected == 0);
      CHECK(effects.work.bytes_sent == 0);
    }
    CHECK(cell.counters().shots > 0);
    CHECK(cell.counters().bytes_sent == 0);
    CHECK(broken_cell_invariant(cell) == "");
  }
}
