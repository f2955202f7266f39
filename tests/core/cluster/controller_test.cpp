#include "core/cluster/controller.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace lichthof;

namespace {

constexpr Epoch epoch{4};

void say(Controller& controller, std::uint32_t cell, const Message& message) {
  controller.accept({CellId{cell}, ToController{}, message}, {});
}

CellReport quiet(std::uint32_t cell, std::uint64_t wave) {
  CellReport report;
  report.cell = CellId{cell};
  report.epoch = epoch;
  report.wave = wave;
  report.idle = true;
  report.shots = 5;
  return report;
}

template <class M>
std::vector<M> sent(const Effects& effects) {
  std::vector<M> found;
  for (const Envelope& envelope : effects.outbox)
    if (const auto* message = std::get_if<M>(&envelope.message)) found.push_back(*message);
  return found;
}

Controller running(std::uint32_t cells) {
  Controller controller({cells, 1e-3, epoch});
  for (std::uint32_t c = 0; c < cells; ++c) say(controller, c, CellReady{CellId{c}, 2.0 + c});
  controller.step({});
  return controller;
}

/// Answers every start and every poll as a quiet cell would, until nothing is left to do. @returns what was sent last
Effects run_to_end(Controller& controller, std::uint32_t cells) {
  for (std::uint32_t c = 0; c < cells; ++c) say(controller, c, quiet(c, 0));
  Effects last;
  for (int guard = 0; controller.has_work() && guard < 20; ++guard) {
    last = controller.step({});
    const auto starts = sent<StartRadiosity>(last);
    for (std::uint32_t c = 0; c < starts.size(); ++c) say(controller, c, quiet(c, 0));
    const auto polls = sent<PollCell>(last);
    for (std::uint32_t c = 0; c < polls.size(); ++c) say(controller, c, quiet(c, polls[c].wave));
  }
  return last;
}

}  // namespace

TEST_SUITE("controller") {
  TEST_CASE("controller: when all cells are ready it starts them with a 64th of the largest initial power") {
    Controller controller({3, 5e-4, epoch});
    CHECK(!controller.has_work());
    say(controller, 0, CellReady{CellId{0}, 0});
    say(controller, 2, CellReady{CellId{2}, 8});
    CHECK(!controller.has_work());
    say(controller, 1, CellReady{CellId{1}, 2});
    const Effects effects = controller.step({});
    const auto starts = sent<StartRadiosity>(effects);
    REQUIRE(starts.size() == 3);
    for (const StartRadiosity& start : starts) {
      CHECK(start.threshold_w == doctest::Approx(0.125));
      CHECK(start.epoch == epoch);
    }
    CHECK(controller.threshold_w() == doctest::Approx(4e-3));
    CHECK(controller.phase() == RunPhase::radiosity);
  }

  TEST_CASE("controller: a cell that is alone goes down to the threshold at once") {
    Controller controller({1, 5e-4, epoch});
    say(controller, 0, CellReady{CellId{0}, 8});
    const auto starts = sent<StartRadiosity>(controller.step({}));
    REQUIRE(starts.size() == 1);
    CHECK(starts[0].threshold_w == doctest::Approx(4e-3));
  }

  TEST_CASE("controller: when nothing is left above the level it is halved; only at the threshold waves prove the end") {
    Controller controller = running(4);  // the largest power is 5 W, the threshold 5 mW
    const auto waiting = [](std::uint32_t cell, std::uint64_t sent) {
      CellReport report = quiet(cell, 0);
      report.strongest_w = 10;  // whatever is left, the level only falls by half
      report.messages_sent = cell == 0 ? sent : 0;
      report.messages_processed = cell == 3 ? sent : 0;
      return report;
    };
    double level = 5.0 / 64;
    CHECK(controller.level_w() == doctest::Approx(level));
    for (std::uint64_t messages = 1; level > 5e-3; ++messages) {
      for (std::uint32_t c = 0; c < 3; ++c) say(controller, c, waiting(c, messages));
      CHECK_FALSE(controller.has_work());  // the last cell is busy, or a message on its way
      say(controller, 3, waiting(3, messages - 1));
      CHECK_FALSE(controller.has_work());
      say(controller, 3, waiting(3, messages));
      REQUIRE(controller.has_work());
      const Effects effects = controller.step({});
      level = std::max(level / 2, 5e-3);
      const auto starts = sent<StartRadiosity>(effects);
      REQUIRE(starts.size() == 4);
      for (const StartRadiosity& start : starts) CHECK(start.threshold_w == doctest::Approx(level));
      CHECK(sent<PollCell>(effects).empty());
    }
    CHECK(controller.level_w() == controller.threshold_w());
    for (std::uint32_t c = 0; c < 4; ++c) say(controller, c, waiting(c, 100));
    CHECK(sent<PollCell>(controller.step({})).size() == 4);
    CHECK_FALSE(controller.finished());
  }

  TEST_CASE("controller: levels at which nobody would shoot are passed over") {
    Controller controller = running(2);  // 3 W, 3 mW
    for (std::uint32_t c = 0; c < 2; ++c) {
      CellReport report = quiet(c, 0);
      report.strongest_w = 0.005 * (c + 1);
      say(controller, c, report);
    }
    const auto starts = sent<StartRadiosity>(controller.step({}));
    REQUIRE(starts.size() == 2);
    CHECK(starts[0].threshold_w == doctest::Approx(0.005));
    for (std::uint32_t c = 0; c < 2; ++c) say(controller, c, quiet(c, 0));
    CHECK(sent<StartRadiosity>(controller.step({}))[0].threshold_w == doctest::Approx(3e-3));
  }

  TEST_CASE("controller: two quiet waves, then it stops every cell and says so") {
    for (const std::uint32_t cells : {1u, 4u}) {
      Controller controller = running(cells);
      const Effects last = run_to_end(controller, cells);
      CHECK(sent<StopRadiosity>(last).size() == cells);
      REQUIRE(last.events.size() == 1);
      CHECK(std::get<Converged>(last.events[0]).shots == 5 * cells);
      CHECK(controller.converged());
      CHECK(controller.progress().waves == 2);
      CHECK(!controller.has_work());
    }
  }

  TEST_CASE("controller: stopped after pending work it drains, and does not claim to have converged") {
    Controller controller = running(2);
    controller.stop(Stop::after_pending);
    const auto starts = sent<StartRadiosity>(controller.step({}));
    REQUIRE(starts.size() == 2);
    CHECK(std::isinf(starts[0].threshold_w));
    CHECK(controller.phase() == RunPhase::draining);
    CHECK(!controller.finished());
    const Effects last = run_to_end(controller, 2);
    CHECK(sent<StopRadiosity>(last).size() == 2);
    CHECK(last.events.empty());
    CHECK(controller.finished());
    CHECK(!controller.converged());
  }

  TEST_CASE("controller: stopped at once it waits for nobody, even before all cells are ready") {
    Controller controller({2, 1e-3, epoch});
    say(controller, 0, CellReady{CellId{0}, 1});
    controller.stop(Stop::after_pending);
    CHECK(sent<StopRadiosity>(controller.step({})).size() == 2);
    CHECK(controller.finished());

    Controller draining = running(2);
    draining.stop(Stop::after_pending);
    draining.step({});
    draining.stop(Stop::at_once);
    CHECK(sent<StopRadiosity>(draining.step({})).size() == 2);
    CHECK(draining.finished());
    draining.stop(Stop::at_once);
    CHECK(!draining.has_work());
  }

  TEST_CASE("controller: a change starts a converged run again, from the first level to the same threshold") {
    Controller controller = running(2);
    run_to_end(controller, 2);
    controller.accept({ToController{}, ToController{}, GeometryChange{{}, SetEmission{0, Rgb{1.0}}}}, {});
    const Effects effects = controller.step({});
    REQUIRE(effects.outbox.size() == 4);
    CHECK(std::get<GeometryChange>(effects.outbox[0].message).version == SceneVersion{1});
    CHECK(std::get<StartRadiosity>(effects.outbox[2].message).threshold_w == doctest::Approx(3.0 / 64));
    CHECK(controller.threshold_w() == doctest::Approx(3e-3));
    CHECK(!controller.finished());
    CHECK(sent<StopRadiosity>(run_to_end(controller, 2)).size() == 2);
    CHECK(controller.converged());
  }

  TEST_CASE("controller: what can not be is refused with an event") {
    Controller controller({2, 1e-3, epoch});
    say(controller, 0, CellReady{CellId{1}, 1});  // for another cell
    say(controller, 7, CellReady{CellId{7}, 1});
    say(controller, 0, CellReady{CellId{0}, std::numeric_limits<double>::quiet_NaN()});
    say(controller, 0, CellReady{CellId{0}, -1});
    say(controller, 0, StartRadiosity{epoch, 0});
    say(controller, 0, GeometryChange{{}, SetEmission{0, Rgb{1.0}}});
    controller.accept({ToController{}, ToController{}, GeometryChange{{}, SetReflectance{0, Rgb{1.5}}}}, {});
    const Effects effects = controller.step({});
    CHECK(effects.events.size() == 7);
    CHECK(effects.outbox.empty());
    CHECK(controller.version() == SceneVersion{0});
  }

  TEST_CASE("controller: progress sums the latest reports, and is refreshed on demand only") {
    Controller controller = running(2);
    CHECK(!controller.has_work());
    controller.refresh_progress();
    const auto polls = sent<PollCell>(controller.step({}));
    REQUIRE(polls.size() == 2);
    CHECK(polls[0].wave == 0);
    for (std::uint32_t c = 0; c < 2; ++c) {
      CellReport report = quiet(c, 0);
      report.idle = c == 1;
      report.strongest_w = 0.5 + c;
      report.unshot_w = Rgb{1.0, 2.0, 3.0};
      say(controller, c, report);
    }
    const RadiosityProgress progress = controller.progress();
    CHECK(progress.cells == 2);
    CHECK(progress.cells_ready == 2);
    CHECK(progress.cells_idle == 1);
    CHECK(progress.shots == 10);
    CHECK(progress.strongest_w == 1.5);
    CHECK(progress.unshot_w == Rgb{2.0, 4.0, 6.0});
    CHECK(progress.largest_initial_power_w == 3.0);
  }
}
