// Balancer and workers as actors on a scheduler that runs only when told to.
#include "actors/balancer_actor.hpp"

#include <doctest/doctest.h>

#include <stdexcept>

#include "actors/company.hpp"
#include "actors/worker_actor.hpp"
#include "tests/actors/test_system.hpp"

using namespace lichthof;

namespace {

/// Columns that say who they are; some may be impossible to trace.
class PaintedColumns final : public ColumnSource {
 public:
  explicit PaintedColumns(std::uint32_t impossible = ~0u) : impossible_(impossible) {}
  std::uint32_t width() const override { return 40; }
  std::uint32_t height() const override { return 3; }
  std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const override {
    std::vector<Rgbf> pixels;
    for (std::uint32_t column = job.first; column < job.last; ++column)
      for (std::uint32_t row = 0; row < height(); ++row) {
        if (column == impossible_) throw std::runtime_error("a column of lead");
        pixels.emplace_back(static_cast<float>(column), static_cast<float>(row), 1.f);
      }
    rays += pixels.size();
    return pixels;
  }

 private:
  std::uint32_t impossible_;
};

struct Pass : test::TestSystem {
  std::shared_ptr<const ColumnSource> source;
  std::shared_ptr<Balancer> balancer;
  std::shared_ptr<actors::TraceRecord> record = std::make_shared<actors::TraceRecord>();
  actors::Clock clock;
  actors::BalancerActor lead;
  std::vector<actors::WorkerActor> workers;

  explicit Pass(std::uint32_t count, std::uint32_t impossible = ~0u)
      : source(std::make_shared<PaintedColumns>(impossible)) {
    BalancerOptions options;
    options.columns = source->width(), options.height = source->height(), options.workers = count;
    balancer = std::make_shared<Balancer>(options);
    lead = system.spawn(actors::balancer_actor, balancer, clock, record, std::shared_ptr<actors::Meters>());
    self->monitor(lead);
    for (WorkerId id{0}; id.value < count; ++id.value)
      workers.push_back(system.spawn(actors::worker_actor, id, std::make_shared<Worker>(id, source, 1), lead, clock,
                                     std::shared_ptr<actors::Meters>()));
  }
  ~Pass() {
    for (const auto& worker : workers) actors::kill_now(worker);
    actors::kill_now(lead);
    scheduler.run();
  }
  void check_picture() const {
    for (std::uint32_t column = 0; column < source->width(); ++column)
      for (std::uint32_t row = 0; row < source->height(); ++row)
        CHECK(balancer->image().at(column, row) == Rgbf(static_cast<float>(column), static_cast<float>(row), 1.f));
  }
};

}  // namespace

TEST_SUITE("balancer actor") {
  TEST_CASE("balancer actor: workers fetch the picture column by column, then all go home") {
    Pass pass(3);
    pass.scheduler.run();
    CHECK(pass.balancer->finished());
    CHECK(!pass.reason_of_end());
    CHECK(pass.record->finished_columns == 40);
    CHECK(pass.record->last_result.size() == 3);
    CHECK(pass.balancer->rays() == 120);
    pass.check_picture();
  }

  TEST_CASE("balancer actor: the columns of a dead worker go to the others") {
    for (int moment = 1; moment < 60; ++moment) {
      Pass pass(3);
      for (int k = 0; k < moment; ++k) pass.scheduler.try_run_once();
      actors::kill_now(pass.workers[1]);
      pass.scheduler.run();
      CAPTURE(moment);
      REQUIRE(pass.balancer->finished());
      CHECK(!pass.reason_of_end());
      pass.check_picture();
    }
  }

  TEST_CASE("balancer actor: without any worker left the pass ends with the reason") {
    Pass pass(2, 17);  // whoever gets this column fails
    pass.scheduler.run();
    CHECK(!pass.balancer->finished());
    const std::string reason = actors::text(pass.reason_of_end());
    CHECK(reason.find("a column of lead") != std::string::npos);
    CHECK(pass.record->finished_columns < 40);
  }

  TEST_CASE("balancer actor: workers do not outlive it") {
    Pass pass(2);
    for (int k = 0; k < 8; ++k) pass.scheduler.try_run_once();
    pass.self->monitor(pass.workers[0]);
    actors::kill_now(pass.lead);
    pass.scheduler.run();
    CHECK(pass.reason_of_end() == caf::exit_reason::kill);
    CHECK(pass.reason_of_end() == caf::exit_reason::kill);
  }

  TEST_CASE("balancer actor: a worker that enlists twice, or with nothing, is counted once") {
    Pass pass(1);
    pass.self->send(pass.lead, actors::Enlistment{WorkerId{0}, pass.workers[0]});
    pass.self->send(pass.lead, actors::Enlistment{WorkerId{5}, {}});
    pass.scheduler.run();
    CHECK(pass.balancer->finished());
    CHECK(!pass.reason_of_end());
  }
}
