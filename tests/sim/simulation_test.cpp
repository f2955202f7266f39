#include "sim/simulation.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sim/oracle.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;
using namespace lichthof::sim;

namespace {

/// Works off one message a step, each a fixed number of rays; the first machine sends the others their messages.
struct Clerk {
  Address self;
  std::vector<Address> to;
  std::uint64_t rays = 0;
  std::vector<std::pair<std::int64_t, std::uint64_t>> heard;  // when, what
  std::size_t waiting = 0;
  bool has_begun = true;

  void accept(const Envelope& envelope, Instant now) {
    heard.emplace_back(now.ns, std::get<PollCell>(envelope.message).wave);
    ++waiting;
  }
  bool has_work() const { return waiting > 0 || !has_begun; }
  Effects step(Instant) {
    Effects effects;
    effects.work.rays = rays;
    if (has_begun) --waiting;
    has_begun = true;
    for (std::uint64_t wave = 1; wave <= 3; ++wave)
      for (const Address& address : to) effects.outbox.push_back({self, address, PollCell{{}, wave}});
    return effects;
  }
};

SimulationOptions plain() {
  SimulationOptions options;
  options.network = {Duration{1000}, Duration{10}, 1e9, Duration{0}};
  options.cost = {};
  options.cost.step_ns = 100;
  options.cost.ray_ns = 10;
  return options;
}

}  // namespace

TEST_SUITE("simulation parts") {
  TEST_CASE("event_queue: events leave by time, at one instant in the order they came") {
    EventQueue<std::string> queue;
    queue.push(Instant{5}, "c");
    queue.push(Instant{3}, "a");
    queue.push(Instant{3}, "b");
    CHECK(queue.pop() == "a");
    CHECK(queue.pop() == "b");
    CHECK(queue.now() == Instant{3});
    queue.push(Instant{3}, "b2");
    CHECK(queue.pop() == "b2");
    CHECK(queue.pop() == "c");
    CHECK(queue.empty());
  }

  TEST_CASE("network_model: latency plus bytes over bandwidth, the link one message at a time") {
    NetworkModel network({Duration{1000}, Duration{10}, 1e9, Duration{0}}, 1);
    const NetworkModel::Trip far{CellId{0}, CellId{1}, NodeId{0}, NodeId{1}},
        near{CellId{0}, CellId{2}, NodeId{0}, NodeId{0}};
    CHECK(network.arrival(far, 500, Instant{0}) == Instant{1500});
    CHECK(network.arrival(far, 500, Instant{0}) == Instant{2000});  // waits for the first to leave
    CHECK(network.arrival(near, 500, Instant{0}) == Instant{10});
  }

  TEST_CASE("network_model: random delays never reorder a pair, and do reorder pairs") {
    NetworkModel network({Duration{1000}, Duration{10}, 1e12, Duration{100'000}}, 7);
    std::int64_t last[2] = {0, 0};
    bool overtaken = false;
    for (int k = 0; k < 200; ++k) {
      std::int64_t at[2];
      for (std::uint32_t to = 0; to < 2; ++to) {
        at[to] = network.arrival({CellId{9}, CellId{to}, NodeId{9}, NodeId{to}}, 10, Instant{k * 1000}).ns;
        CHECK(at[to] >= last[to]);
        last[to] = at[to];
      }
      overtaken = overtaken || at[1] < at[0];
    }
    CHECK(overtaken);
  }

  TEST_CASE("cost_model: work times coefficients, divided by the speed of the node") {
    CostModel cost;
    WorkDone work;
    work.rays = 1000;
    work.bitmaps_projected = 2;
    CHECK(cost.duration(work, 1).ns ==
          static_cast<std::int64_t>(cost.step_ns + 1000 * cost.ray_ns + 2 * cost.bitmap_ns));
    CHECK(cost.duration(work, 4).ns == cost.duration(work, 1).ns / 4);
  }

  TEST_CASE("simulation: what a step sends leaves when the step ends; meanwhile messages are filed") {
    Simulation simulation(plain());
    Clerk sender{CellId{0}, {CellId{1}}, 50, {}, 0, false}, receiver{CellId{1}, {}, 200, {}, 0, true};
    simulation.add(CellId{0}, NodeId{0}, sender);
    simulation.add(CellId{1}, NodeId{1}, receiver);
    const SimulationReport report = simulation.run();
    REQUIRE(receiver.heard.size() == 3);
    // The step takes 100 + 50 rays * 10 ns; a message has 64 bytes: 64 ns on the link, 1000 ns under way.
    CHECK(receiver.heard[0] == std::pair<std::int64_t, std::uint64_t>{600 + 64 + 1000, 1});
    CHECK(receiver.heard[1] == std::pair<std::int64_t, std::uint64_t>{600 + 128 + 1000, 2});
    CHECK(report.steps == 4);
    CHECK(report.end.ns == 600 + 64 + 1000 + 3 * 2100);
    CHECK(report.nodes.at(NodeId{1}).busy.ns == 3 * 2100);
    CHECK(report.messages == 3);
    CHECK(report.bytes == 3 * 64);
  }

  TEST_CASE("simulation: machines of one node take turns, those of two nodes work at the same time") {
    for (const bool is_shared : {true, false}) {
      Simulation simulation(plain());
      Clerk sender{CellId{0}, {CellId{1}, CellId{2}}, 0, {}, 0, false}, one{CellId{1}, {}, 1000, {}, 0, true},
          two{CellId{2}, {}, 1000, {}, 0, true};
      simulation.add(CellId{0}, NodeId{0}, sender);
      simulation.add(CellId{1}, NodeId{1}, one);
      simulation.add(CellId{2}, NodeId{is_shared ? 1u : 2u}, two);
      const std::int64_t end = simulation.run().end.ns;
      CHECK(end > (is_shared ? 60'000 : 30'000));
      CHECK(end < (is_shared ? 64'000 : 34'000));
    }
  }

  TEST_CASE("oracle: it sees a message that nobody sent") {
    const test::ToyWorld world = test::toy_world({2, 1, 1}, 1, 1);
    const Cell cell(CellId{0}, world.grid, std::make_unique<test::ToyLight>(world, CellId{0}), {});
    const Cell other(CellId{1}, world.grid, std::make_unique<test::ToyLight>(world, CellId{1}), {});
    const Controller controller({2, 1e-3, {}});
    Oracle oracle(world.grid, {&cell, &other}, controller);
    CHECK(oracle.broken() == "");
    const Envelope forged{CellId{1}, CellId{0}, HemicubeMessage{}};
    oracle.observe({CellId{0}, &forged, nullptr, Instant{9}});
    CHECK(oracle.broken().find("nobody sent") != std::string::npos);
  }

  TEST_CASE("oracle: it sees energy that appears from nowhere, and an end that comes too early") {
    const test::ToyWorld world = test::toy_world({1, 1, 1}, 1, 1);
    const Cell cell(CellId{0}, world.grid, std::make_unique<test::ToyLight>(world, CellId{0}), {});
    const Controller controller({1, 1e-3, {}});
    Effects claims_too_much;
    claims_too_much.events.push_back(ShotFired{{CellId{0}, 0}, 1.0, false, CellId{0}, 0.5});
    Oracle energy(world.grid, {&cell}, controller);
    energy.observe({CellId{0}, nullptr, &claims_too_much, Instant{1}});
    CHECK(energy.broken().find("received") != std::string::npos);

    Effects converged;
    converged.events.push_back(Converged{0});
    Oracle early(world.grid, {&cell}, controller);  // its lamp has not shot
    early.observe({ToController{}, nullptr, &converged, Instant{1}});
    CHECK(early.broken().find("above the threshold") != std::string::npos);
  }
}
