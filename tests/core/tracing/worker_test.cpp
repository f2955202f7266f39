#include "core/tracing/worker.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
/// Pixels that tell their column.
class Stripes : public ColumnSource {
 public:
  std::uint32_t width() const override { return 20; }
  std::uint32_t height() const override { return 2; }
  std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const override {
    std::vector<Rgbf> pixels;
    for (std::uint32_t c = job.first; c < job.last; ++c) pixels.insert(pixels.end(), 2, Rgbf{static_cast<float>(c)});
    rays += pixels.size();
    return pixels;
  }
};
Envelope assignment(std::uint32_t first, std::uint32_t last, bool no_more = false) {
  return {ToBalancer{}, WorkerId{1}, JobAssignment{{first, last}, no_more}};
}
}  // namespace

TEST_CASE("worker: asks, traces in slices, delivers, asks again, rests when told") {
  Worker worker(WorkerId{1}, std::make_shared<Stripes>(), 4);
  REQUIRE(worker.has_work());
  const Effects asked = worker.step({});
  REQUIRE(asked.outbox.size() == 1);
  CHECK(std::get<JobRequest>(asked.outbox[0].message).worker == WorkerId{1});
  CHECK_FALSE(worker.has_work());

  worker.accept(assignment(3, 9), {});
  const Effects first = worker.step({});
  CHECK(first.outbox.empty());
  CHECK(first.work.pixels_traced == 8);
  const Effects last = worker.step({});
  REQUIRE(last.outbox.size() == 2);
  const auto& result = std::get<ColumnResult>(last.outbox[0].message);
  CHECK(result.job.first == 3);
  CHECK(result.job.last == 9);
  CHECK(result.rays == std::vector<std::uint64_t>(6, 2));
  REQUIRE(result.pixels.size() == 12);
  CHECK(result.pixels[0].x == 3);
  CHECK(result.pixels[11].x == 8);
  CHECK(std::holds_alternative<JobRequest>(last.outbox[1].message));
  CHECK_FALSE(worker.has_work());

  worker.accept(assignment(0, 0, true), {});
  CHECK(worker.resting());
  CHECK_FALSE(worker.has_work());
}

TEST_CASE("worker: an assignment that can't be is ignored, and so is a second one at a time") {
  Worker worker(WorkerId{1}, std::make_shared<Stripes>());
  (void)worker.step({});
  worker.accept(assignment(5, 5), {});
  worker.accept(assignment(5, 21), {});
  CHECK_FALSE(worker.has_work());
  worker.accept(assignment(0, 2), {});
  worker.accept(assignment(7, 9), {});
  const Effects done = worker.step({});
  CHECK(std::get<ColumnResult>(done.outbox[0].message).job.last == 2);
  CHECK_FALSE(worker.has_work());
}
