#include "core/cluster/retention.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {

constexpr double day = 86400;

RetentionOptions options() {
  RetentionOptions options;
  options.most_jobs = 3, options.most_bytes = 100, options.most_days = 30, options.unfetched_days = 7;
  return options;
}

std::vector<std::uint64_t> numbers(const Retention& retention) {
  std::vector<std::uint64_t> all;
  for (const JobId id : retention.forgotten) all.push_back(id.value);
  return all;
}

using Numbers = std::vector<std::uint64_t>;

}  // namespace

TEST_SUITE("retention") {
  TEST_CASE("retention: within the bounds nothing is forgotten") {
    CHECK(retention({}, options(), 0).forgotten.empty());
    const Retention kept = retention({{JobId{1}, 0, false, 50}, {JobId{2}, day, true, 50}}, options(), 2 * day);
    CHECK(kept.forgotten.empty());
    CHECK(!kept.is_full);
  }

  TEST_CASE("retention: beyond the number the oldest go that nobody will miss") {
    const std::vector<EndedJob> ended = {
        {JobId{1}, 5 * day, true, 1}, {JobId{2}, 4 * day, false, 1}, {JobId{3}, 3 * day, false, 1},
        {JobId{4}, 2 * day, true, 1}, {JobId{5}, 1 * day, false, 1},
    };
    const Retention left = retention(ended, options(), 6 * day);
    CHECK(numbers(left) == Numbers{5, 3});
    CHECK(!left.is_full);
    // Nine days later job 4 has waited long enough to be fetched.
    CHECK(numbers(retention(ended, options(), 9 * day)) == Numbers{5, 4});
  }

  TEST_CASE("retention: beyond the bytes the oldest go until the rest fits") {
    const Retention left =
        retention({{JobId{1}, 0, false, 60}, {JobId{2}, 1, false, 50}, {JobId{3}, 2, false, 50}}, options(), day);
    CHECK(numbers(left) == Numbers{1});
    CHECK(!left.is_full);
  }

  TEST_CASE("retention: what has not been fetched stays its time, and is full by itself") {
    std::vector<EndedJob> ended;
    for (std::uint64_t id = 1; id <= 4; ++id) ended.push_back({JobId{id}, 0, true, 1});
    const Retention full = retention(ended, options(), 6.9 * day);
    CHECK(full.forgotten.empty());
    CHECK(full.is_full);
    const Retention later = retention(ended, options(), 7 * day);
    CHECK(numbers(later) == Numbers{1});
    CHECK(!later.is_full);
  }

  TEST_CASE("retention: what is old goes, whether fetched or not") {
    const std::vector<EndedJob> ended = {{JobId{1}, 0, false, 1}, {JobId{2}, 0, true, 1}, {JobId{3}, 1 * day, true, 1}};
    CHECK(numbers(retention(ended, options(), 30 * day)) == Numbers{1, 2});
    // A bound below the time to fetch is none: the time holds.
    RetentionOptions hasty = options();
    hasty.most_days = 1;
    CHECK(numbers(retention(ended, hasty, 3 * day)) == Numbers{1});
  }
}
