// Whole passes inside this process: the real light behind the real actors.
#include "actors/local_run.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "actors/meter.hpp"
#include "core/light/expected_light.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace std::chrono_literals;

namespace {

/// Two rooms of 3 x 3 x 2.5 m side by side along x; a doorway in the wall between them; a lamp in the first one.
/// @param door  its width (m); its middle is that of the wall
/// @param thickness  of the wall, whose middle is at x = 3 (m)
std::shared_ptr<const Scene> two_rooms(double door = 1, double thickness = 0) {
  auto scene = std::make_shared<Scene>();
  const std::uint32_t wall = test::add_material(*scene, test::diffuse(0.6));
  const std::uint32_t lamp = test::add_material(*scene, test::luminous(20, 0.2));
  test::add_box(*scene, {0, 0, 0}, {6, 3, 2.5}, wall, true);
  // The wall in the middle, two pieces beside and one above the door.
  const double beside = (3 - door) / 2;
  for (const double x : {3 - thickness / 2, 3 + thickness / 2}) {
    test::add_rectangle(*scene, {x, 0, 0}, {0, beside, 0}, {0, 0, 2.5}, wall);
    test::add_rectangle(*scene, {x, 3 - beside, 0}, {0, beside, 0}, {0, 0, 2.5}, wall);
    test::add_rectangle(*scene, {x, beside, 2}, {0, door, 0}, {0, 0, 0.5}, wall);
    if (thickness == 0) break;
  }
  for (const double y : {beside, 3 - beside})
    if (thickness > 0) test::add_rectangle(*scene, {3 - thickness / 2, y, 0}, {thickness, 0, 0}, {0, 0, 2}, wall);
  test::add_rectangle(*scene, {1, 1, 2.4}, {0, 1, 0}, {1, 0, 0}, lamp);
  return scene;
}

struct Case {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Mesh> mesh;

  explicit Case(double patch_size = 0.5, std::shared_ptr<const Scene> scene_ = two_rooms()) : scene(std::move(scene_)) {
    MeshOptions options;
    options.patch_size = patch_size;
    mesh = std::make_shared<const Mesh>(mesh_of(*scene, options, {}));
  }

  actors::SolveRun run(const CellPosition& cells, unsigned threads = 1, double eps = 1e-3) const {
    actors::SolveRun run;
    run.scene = scene;
    run.mesh = mesh;
    CellsWanted wanted;
    wanted.count = cells[0] * cells[1] * cells[2];
    wanted.along = cells;
    Expected<CellGrid> grid = partition(*mesh, bounds(*scene), wanted);
    REQUIRE(grid);
    run.grid = std::make_shared<const CellGrid>(std::move(*grid));
    run.options.mesh = mesh->options;
    run.options.cells = cells;
    run.options.eps = eps;
    run.parallel = std::make_shared<const Parallel>(threads);
    return run;
  }
};

/// Root mean square over the area of the difference in irradiance, relative to that of the irradiance.
/// @param from_x  of the patches whose centre lies beyond (m)
double relative_difference(const Solution& a, const Solution& b, double from_x = -1e30) {
  double difference = 0, scale = 0;
  for (const Patch& patch : a.mesh->patches)
    for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.element_count; ++e) {
      if (!(patch.centre.x > from_x)) continue;
      const double area = a.mesh->elements[e].area;
      const Rgb d = Rgb{a.irradiance[e]} - Rgb{b.irradiance[e]};
      difference += area * glm::dot(d, d);
      scale += area * glm::dot(Rgb{b.irradiance[e]}, Rgb{b.irradiance[e]});
    }
  return std::sqrt(difference / scale);
}

bool same_bits(const Solution& a, const Solution& b) {
  return a.irradiance == b.irradiance && a.direct_irradiance == b.direct_irradiance && a.shot == b.shot &&
         a.pending == b.pending;
}

/// The solver without actors: shoot the strongest group until none is above the threshold.
Solution plain_loop(const actors::SolveRun& run) {
  std::vector<GroupId> groups;
  for (std::uint32_t g = 0; g < run.mesh->groups.size(); ++g) groups.push_back(GroupId{g});
  const auto exchange = std::make_shared<const GroupExchange>(*run.scene, *run.mesh, *run.parallel);
  CellLight light(run.scene, run.mesh, groups, Box{Vec3{-1e300}, Vec3{1e300}}, {}, run.parallel, exchange);
  const double threshold_w = run.options.eps * light.largest_initial_power();
  std::uint64_t shots = 0;
  for (auto next = light.strongest(); next.power_w > threshold_w; next = light.strongest())
    light.receive(light.take_shot(next.group, {CellId{0}, shots++}, {}), nullptr);
  Solution solution;
  solution.mesh = run.mesh;
  for (auto* values : {&solution.irradiance, &solution.direct_irradiance, &solution.shot, &solution.pending})
    values->resize(run.mesh->elements.size(), Rgbf{0.f});
  light.store(solution);
  set_pending(solution, *exchange);
  solution.counters.shots = shots;
  return solution;
}

/// A picture of stripes that takes its time.
class SlowColumns final : public ColumnSource {
 public:
  SlowColumns(std::chrono::microseconds pace, std::uint32_t impossible = ~0u) : pace_(pace), impossible_(impossible) {}
  std::uint32_t width() const override { return 64; }
  std::uint32_t height() const override { return 5; }
  std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const override {
    std::vector<Rgbf> pixels;
    for (std::uint32_t column = job.first; column < job.last; ++column) {
      if (column == impossible_) throw std::runtime_error("a column of lead");
      std::this_thread::sleep_for(pace_);
      for (std::uint32_t row = 0; row < height(); ++row)
        pixels.emplace_back(0.1f * static_cast<float>(column), 1.f / (1 + row), 2.f);
    }
    rays += pixels.size();
    return pixels;
  }

 private:
  std::chrono::microseconds pace_;
  std::uint32_t impossible_;
};

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

TEST_SUITE("local run: first pass") {
  TEST_CASE("local run: one cell does bit for bit what the plain loop does") {
    const Case rooms;
    const actors::SolveRun run = rooms.run({1, 1, 1});
    const Solution loop = plain_loop(run), acted = actors::solve(run);
    CHECK(same_bits(loop, acted));
    CHECK(acted.counters.shots == loop.counters.shots);
    CHECK(acted.counters.messages == 0);
  }

  TEST_CASE("local run: four cells reach the light of one cell") {
    const Case rooms(0.25);
    const Solution one = actors::solve(rooms.run({1, 1, 1}, 1, 1e-4)),
                   four = actors::solve(rooms.run({2, 2, 1}, 1, 1e-4));
    CHECK(one.converged);
    CHECK(four.converged);
    CHECK(four.counters.messages > 0);
    CHECK(four.counters.bytes_sent > four.counters.bitmap_bytes);
    // What is left is the bitmaps' resolution and what each of both leaves unshot.
    CHECK(relative_difference(four, one) < 0.02);
    CHECK(std::abs(one.energy.residual()) < 0.02);
    CHECK(std::abs(four.energy.residual()) < 0.02);
    CHECK(one.energy.emitted == doctest::Approx(four.energy.emitted));
    CHECK(one.energy.escaped < 1e-3 * one.energy.emitted);
  }

  TEST_CASE("local run: a room behind a narrow door in a cell's border gets what it gets in one cell") {
    // Rays judge the door alike in both; what is left are shots in another order. Small elements share packets of rays with others
    // of their cell, so those in the reveals of a slit aim elsewhere, and few rays pass it.
    constexpr double tolerance = 0.01, tolerance_of_slit = 0.1;
    for (const double thickness : {0.0, 0.1})
      for (const double door : {0.02, 0.2, 0.8, 2.0}) {
        const Case rooms(0.25, two_rooms(door, thickness));
        const Solution one = actors::solve(rooms.run({1, 1, 1}, 1, 1e-7)),
                       two = actors::solve(rooms.run({2, 1, 1}, 1, 1e-7));
        CAPTURE(door);
        CAPTURE(thickness);
        CHECK(relative_difference(two, one) < tolerance);
        CHECK(relative_difference(two, one, 3.1) < (thickness > door ? tolerance_of_slit : tolerance));
      }
  }

  TEST_CASE("local run: the same run gives the same bits, with one thread and with two, watched or not") {
    const Case rooms;
    const Solution first = actors::solve(rooms.run({2, 2, 1}, 1, 1e-4));
    int looks = 0;
    for (const unsigned threads : {1u, 2u}) {
      actors::SolveRun run = rooms.run({2, 2, 1}, threads, 1e-4);
      run.progress = [&](const RadiosityProgress&) { ++looks; };
      const Solution again = actors::solve(run);
      CAPTURE(threads);
      CHECK(same_bits(first, again));
      CHECK(first.counters.shots == again.counters.shots);
      CHECK(first.counters.bytes_sent == again.counters.bytes_sent);
      CHECK(first.energy.escaped == again.energy.escaped);
    }
    CHECK(looks >= 2);
  }

  TEST_CASE("local run: progress rises to the end") {
    const Case rooms;
    actors::SolveRun run = rooms.run({2, 2, 1}, 1, 1e-9);
    std::vector<RadiosityProgress> seen;
    run.progress = [&](const RadiosityProgress& progress) { seen.push_back(progress); };
    const Solution solution = actors::solve(run);
    REQUIRE(seen.size() >= 2);
    for (std::size_t k = 1; k < seen.size(); ++k) CHECK(seen[k].shots >= seen[k - 1].shots);
    CHECK(seen.back().cells_ready == 4);
    CHECK(seen.back().phase == RunPhase::finished);
    CHECK(seen.back().shots == solution.counters.shots);
    CHECK(sum_channels(seen.back().emitted_w) == doctest::Approx(solution.energy.emitted));
    CHECK(seen.back().threshold_w > 0);
  }

  TEST_CASE("local run: stopped early it keeps a balanced solution, and resumed it reaches the same end") {
    const std::pair<CellPosition, double> cases[] = {{{1, 1, 1}, 1e-5}, {{2, 2, 1}, 1e-4}};
    for (const auto& [cells, eps] : cases) {
      const Case rooms(0.3);
      actors::SolveRun run = rooms.run(cells, 1, eps);
      const Solution whole = actors::solve(run);
      std::atomic<bool> stop = false;
      run.stop = &stop;
      run.progress = [&](const RadiosityProgress&) { stop = true; };
      const Solution half = actors::solve(run);
      CAPTURE(cells[0]);
      REQUIRE(!half.converged);
      CHECK(half.counters.shots > 0);
      CHECK(half.counters.shots < whole.counters.shots);
      // No light is lost on the way: the ledger balances as well as that of the whole run.
      CHECK(std::abs(half.energy.residual()) < std::abs(whole.energy.residual()) + 0.01);

      run.stop = nullptr;
      run.progress = nullptr;
      run.resume = &half;
      const Solution resumed = actors::solve(run);
      CHECK(resumed.converged);
      CHECK(relative_difference(resumed, whole) < 5e-3);
      CHECK(std::abs(resumed.energy.residual() - whole.energy.residual()) < 5e-3);
    }
  }

  TEST_CASE("local run: stopped before it began it returns at once") {
    const Case rooms;
    actors::SolveRun run = rooms.run({2, 2, 1}, 1, 1e-7);
    const std::atomic<bool> stop = true;
    run.stop = &stop;
    Solution solution;
    CHECK(seconds_of([&] { solution = actors::solve(run); }) < 3);
    CHECK(!solution.converged);
  }

  TEST_CASE("local run: an exception of the watcher ends the run and arrives") {
    const Case rooms;
    actors::SolveRun run = rooms.run({2, 2, 1}, 1, 1e-6);
    run.progress = [](const RadiosityProgress&) { throw std::runtime_error("the terminal is gone"); };
    CHECK_THROWS_WITH(actors::solve(run), "the terminal is gone");
  }

  TEST_CASE("local run: a dark scene converges without a shot") {
    auto dark = std::make_shared<Scene>();
    test::add_box(*dark, {0, 0, 0}, {2, 2, 2}, test::add_material(*dark, test::diffuse(0.5)), true);
    Case rooms;
    rooms.scene = dark;
    rooms.mesh = std::make_shared<const Mesh>(mesh_of(*dark, rooms.mesh->options, {}));
    const Solution solution = actors::solve(rooms.run({2, 1, 1}));
    CHECK(solution.converged);
    CHECK(solution.counters.shots == 0);
    CHECK(solution.energy.emitted == 0);
  }

  TEST_CASE("local run: meters show every actor of a run") {
    const Case rooms;
    actors::SolveRun run = rooms.run({2, 2, 1});
    run.meters = std::make_shared<actors::Meters>();
    const Solution solution = actors::solve(run);
    std::uint64_t steps = 0, bytes = 0;
    for (const auto& meter : run.meters->all()) steps += meter->steps, bytes += meter->bytes;
    CHECK(bytes == solution.counters.bytes_sent);
    CHECK(run.meters->all().size() == 5);
    CHECK(steps >= solution.counters.shots + solution.counters.messages / 3);
  }
}

TEST_SUITE("local run: second pass") {
  TEST_CASE("local run: the picture is the same for any number of workers") {
    actors::TraceRun run;
    run.source = std::make_shared<SlowColumns>(100us);
    std::uint64_t rays = 0;
    const std::vector<Rgbf> expected = run.source->columns({0, 64}, rays);
    for (const unsigned workers : {1u, 2u, 5u, 100u})
      for (const Scheduling scheduling : {Scheduling::adaptive, Scheduling::boxes}) {
        run.workers = workers;
        run.scheduling = scheduling;
        const actors::TraceResult result = actors::trace(run);
        CAPTURE(workers);
        CHECK(result.complete);
        CHECK(result.rays == rays);
        CHECK(result.jobs >= std::min(workers, 64u));
        Image image(64, 5);
        image.set_columns(0, expected);
        CHECK(result.image == image);
        CHECK(result.idle_seconds >= 0);
        CHECK(result.idle_seconds <= workers * result.seconds);
      }
  }

  TEST_CASE("local run: a second pass can be watched and stopped") {
    std::atomic<bool> stop = false;
    actors::TraceRun run;
    run.source = std::make_shared<SlowColumns>(100ms);
    run.workers = 2;
    run.stop = &stop;
    std::vector<double> shares;
    run.progress = [&](double share) {
      shares.push_back(share);
      stop = true;
    };
    actors::TraceResult result;
    CHECK(seconds_of([&] { result = actors::trace(run); }) < 2);
    CHECK(!result.complete);
    REQUIRE(shares.size() == 1);
    CHECK(shares[0] >= 0);
    CHECK(shares[0] < 1);
  }

  TEST_CASE("local run: a column that no worker survives ends the pass with the reason") {
    actors::TraceRun run;
    run.source = std::make_shared<SlowColumns>(10us, 40);
    run.workers = 3;
    CHECK_THROWS_WITH_AS(actors::trace(run), doctest::Contains("a column of lead"), std::runtime_error);
  }
}
