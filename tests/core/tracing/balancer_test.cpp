#include "core/tracing/balancer.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {

constexpr std::uint32_t height = 2;

/// Drives a balancer by hand, message by message.
struct Desk {
  Balancer balancer;
  explicit Desk(std::uint32_t columns, std::uint32_t workers, bool second_runs = false)
      : balancer({columns, height, workers, Scheduling::adaptive, 4, 64, second_runs}) {}
  Effects send(Message message) {
    balancer.accept({ToBalancer{}, ToBalancer{}, std::move(message)}, {});
    return balancer.step({});
  }
  /// The job a worker gets for its request; size 0 if none came.
  ColumnJob request(std::uint32_t worker) {
    const Effects effects = send(JobRequest{WorkerId{worker}});
    return effects.outbox.empty() ? ColumnJob{} : std::get<JobAssignment>(effects.outbox[0].message).job;
  }
  static ColumnResult result(std::uint32_t worker, const ColumnJob& job, float value = 1) {
    return {WorkerId{worker}, job, std::vector<Rgbf>(std::size_t{job.size()} * height, Rgbf{value}),
            std::vector<std::uint64_t>(job.size(), 10), 0};
  }
};

}  // namespace

TEST_CASE("balancer: one worker gets the whole picture at once") {
  Desk desk(30, 1);
  const ColumnJob job = desk.request(1);
  CHECK(job.size() == 30);
  const Effects done = desk.send(Desk::result(1, job));
  CHECK(desk.balancer.finished());
  CHECK(desk.balancer.image().at(29, 1).x == 1);
  CHECK(std::holds_alternative<JobFinished>(done.events.at(0)));
}

TEST_CASE("balancer: a result that comes twice counts once, whoever sends it") {
  Desk desk(30, 3);
  const ColumnJob job = desk.request(1);
  (void)desk.send(Desk::result(1, job, 1));
  const std::uint32_t finished = desk.balancer.finished_columns();
  const Effects again = desk.send(Desk::result(2, job, 5));
  CHECK(desk.balancer.finished_columns() == finished);
  CHECK(again.events.empty());
  CHECK(desk.balancer.image().at(job.first, 0).x == 1);
  CHECK(desk.balancer.rays() == 10 * job.size());
}

TEST_CASE("balancer: a request waits while columns are out, and gets those of a lost worker") {
  Desk desk(1, 2);
  const ColumnJob only = desk.request(1);
  CHECK(only.size() == 1);
  CHECK(desk.request(2).size() == 0);
  const Effects lost = desk.send(WorkerLost{WorkerId{1}});
  REQUIRE(lost.outbox.size() == 1);
  CHECK(std::get<WorkerId>(lost.outbox[0].to) == WorkerId{2});
  CHECK(std::get<JobAssignment>(lost.outbox[0].message).job.size() == 1);
  // Asked again while waiting for nothing: told to rest once the picture is finished.
  CHECK(desk.request(3).size() == 0);
  const Effects done = desk.send(Desk::result(2, only));
  REQUIRE(done.outbox.size() == 1);
  CHECK(std::get<JobAssignment>(done.outbox[0].message).no_more);
}

TEST_CASE("balancer: a worker given up for lost may still deliver; its columns are not done twice") {
  Desk desk(40, 4);
  const ColumnJob job = desk.request(1);
  (void)desk.send(WorkerLost{WorkerId{1}});
  (void)desk.send(Desk::result(1, job));
  CHECK(desk.balancer.finished_columns() == job.size());
  std::vector<std::uint8_t> seen(40, 0);
  for (ColumnJob next = desk.request(2); next.size() > 0; next = desk.request(2))
    for (std::uint32_t c = next.first; c < next.last; ++c) {
      CHECK_FALSE((c >= job.first && c < job.last));
      CHECK(++seen[c] == 1);
    }
}

TEST_CASE("balancer: nonsense is refused, and its sender gets no more work") {
  Desk desk(40, 2);
  const ColumnJob job = desk.request(1);
  ColumnResult torn = Desk::result(1, job);
  torn.pixels.pop_back();
  CHECK(std::holds_alternative<MessageRefused>(desk.send(torn).events.at(0)));
  CHECK(desk.balancer.finished_columns() == 0);
  CHECK(desk.request(1).size() == 0);
  ColumnResult beyond = Desk::result(2, {39, 41});
  CHECK(std::holds_alternative<MessageRefused>(desk.send(beyond).events.at(0)));
  CHECK(std::holds_alternative<MessageRefused>(desk.send(CellReady{}).events.at(0)));
  // An honest worker still does the whole picture.
  for (ColumnJob next = desk.request(3); next.size() > 0; next = desk.request(3))
    (void)desk.send(Desk::result(3, next));
  CHECK(desk.balancer.finished());
}

TEST_CASE("balancer: fewer columns than workers") {
  Desk desk(3, 8);
  for (std::uint32_t w = 0; w < 3; ++w) CHECK(desk.request(w).size() == 1);
  for (std::uint32_t w = 3; w < 8; ++w) CHECK(desk.request(w).size() == 0);
}

TEST_CASE("balancer: columns out at the end are run a second time, and no more, by whoever is idle") {
  Desk desk(40, 3, true);
  const ColumnJob stuck = desk.request(1);
  REQUIRE(stuck.size() > 1);
  std::vector<ColumnJob> again;
  std::uint32_t handed_out = stuck.size();
  while (handed_out < 40) {
    const ColumnJob job = desk.request(2);
    handed_out += job.size();
    (void)desk.send(Desk::result(2, job));
  }
  CHECK(desk.balancer.second_runs() == 0);
  // Two workers share what the third does not deliver; nothing of it is theirs already.
  for (std::uint32_t worker = 2; !desk.balancer.finished(); worker = 5 - worker) {
    const ColumnJob job = desk.request(worker);
    REQUIRE(job.size() > 0);
    CHECK(job.first >= stuck.first);
    CHECK(job.last <= stuck.last);
    again.push_back(job);
    // Nobody gets a column that two have.
    if (again.size() == stuck.size()) CHECK(desk.request(4).size() == 0);
    (void)desk.send(Desk::result(worker, job, 2));
  }
  CHECK(desk.balancer.second_runs() == again.size());
  CHECK(desk.balancer.rays() == 10 * 40);
  // The late one changes nothing.
  CHECK(desk.send(Desk::result(1, stuck, 5)).events.empty());
  CHECK(desk.balancer.rays() == 10 * 40);
  CHECK(desk.balancer.image().at(stuck.first, 0).x == 2);
}

TEST_CASE("balancer: a late result counts for the columns that nobody has delivered before, rays too") {
  Desk wide(30, 2, true);
  const ColumnJob late = wide.request(1), other = wide.request(2);
  REQUIRE(late.size() > 2);
  (void)wide.send(Desk::result(2, other));
  ColumnJob next = wide.request(2);
  for (; next.first >= late.last || next.last <= late.first; next = wide.request(2))
    (void)wide.send(Desk::result(2, next));
  REQUIRE(next.size() < late.size());
  (void)wide.send(Desk::result(2, next, 2));
  (void)wide.send(Desk::result(1, late, 3));
  CHECK(wide.balancer.finished());
  CHECK(wide.balancer.rays() == 10 * 30);
  CHECK(wide.balancer.image().at(next.first, 0).x == 2);
  CHECK(wide.balancer.image().at(late.last - 1, 0).x == 3);
}

TEST_CASE("balancer: a second run comes back when its worker is lost, and is nobody's own column") {
  Desk desk(1, 3, true);
  const ColumnJob only = desk.request(1);
  CHECK(desk.request(1).size() == 0);  // has it already
  const Effects second = desk.send(JobRequest{WorkerId{2}});
  REQUIRE(second.outbox.size() == 1);
  CHECK(desk.request(3).size() == 0);  // two have it
  // One of the two is lost: the third takes its place.
  const Effects lost = desk.send(WorkerLost{WorkerId{1}});
  REQUIRE(lost.outbox.size() == 1);
  CHECK(std::get<WorkerId>(lost.outbox[0].to) == WorkerId{3});
  (void)desk.send(Desk::result(3, only));
  CHECK(desk.balancer.finished());
  CHECK(desk.balancer.rays() == 10);
}
