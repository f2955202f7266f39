#include "core/cluster/presence.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {

constexpr std::int64_t second = 1'000'000'000;

Instant at(std::int64_t s) { return {s * second}; }
OwnerSigns touched(std::int64_t seconds_ago) { return {Duration{seconds_ago * second}, false, 0}; }
OwnerSigns busy(double cores) { return {Duration{100'000 * second}, false, cores}; }

}  // namespace

TEST_SUITE("presence") {
  TEST_CASE("presence: the owner is away when nothing has been touched for as long as was said") {
    Presence presence({Duration{300 * second}, 0, {}});
    CHECK_FALSE(presence.look(touched(299), at(1000)));
    CHECK(presence.look(touched(300), at(1001)));
    CHECK(presence.look(touched(5000), at(1002)));
  }

  TEST_CASE("presence: one touch brings him back at once, and for the whole time") {
    Presence presence({Duration{300 * second}, 0, {}});
    REQUIRE(presence.look(touched(5000), at(1000)));
    CHECK_FALSE(presence.look(touched(0), at(1001)));
    CHECK_FALSE(presence.look(touched(298), at(1299)));
    CHECK(presence.look(touched(300), at(1301)));
    // The terminal that was touched may be closed by then, and the next newest be an old one.
    Presence other({Duration{300 * second}, 0, {}});
    CHECK_FALSE(other.look(touched(0), at(1000)));
    CHECK_FALSE(other.look(touched(9000), at(1100)));
    CHECK_FALSE(other.look({}, at(1299)));
    CHECK(other.look({}, at(1300)));
  }

  TEST_CASE("presence: a machine without terminals has an owner who is away") {
    Presence presence({});
    CHECK(presence.look({}, at(0)));
  }

  TEST_CASE("presence: a touch in the future, by a clock set back, counts as now") {
    Presence presence({Duration{300 * second}, 0, {}});
    CHECK_FALSE(presence.look(touched(-3600), at(1000)));
    CHECK_FALSE(presence.look(touched(1000), at(1299)));
    CHECK(presence.look(touched(1001), at(1300)));
  }

  TEST_CASE("presence: programs of others count once they have been busy for a while") {
    Presence presence({Duration{300 * second}, 0.5, Duration{5 * second}});
    CHECK(presence.look(busy(0), at(1000)));
    CHECK(presence.look(busy(2), at(1001)));  // a moment's work
    CHECK(presence.look(busy(0.5), at(1003)));
    CHECK(presence.look(busy(2), at(1004)));
    CHECK(presence.look(busy(2), at(1008)));
    CHECK_FALSE(presence.look(busy(2), at(1009)));
    CHECK_FALSE(presence.look(busy(0), at(1308)));
    CHECK(presence.look(busy(0), at(1309)));
    Presence blind({Duration{300 * second}, 0, Duration{5 * second}});
    for (int s = 0; s < 20; ++s) CHECK(blind.look(busy(64), at(s)));
  }

  TEST_CASE("presence: a desktop that is in use keeps the node away, and no longer than that") {
    Presence presence({Duration{300 * second}, 0.5, {}});
    CHECK_FALSE(presence.look({std::nullopt, true, 0}, at(1000)));
    CHECK(presence.look({std::nullopt, false, 0}, at(1001)));
  }
}
