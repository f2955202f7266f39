#include "core/cluster/termination.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
CellReport report(std::uint32_t cell, std::uint64_t wave, std::uint64_t sent, std::uint64_t processed,
                  bool idle = true) {
  CellReport r;
  r.cell = CellId{cell};
  r.wave = wave;
  r.idle = idle;
  r.messages_sent = sent;
  r.messages_processed = processed;
  return r;
}
}  // namespace

TEST_SUITE("termination") {
  TEST_CASE("termination: two quiet waves with the same counts end the run, one does not") {
    Termination termination(2);
    CHECK(!termination.wave_to_start());
    termination.file(report(0, 0, 3, 1));
    CHECK(!termination.wave_to_start());
    termination.file(report(1, 0, 1, 3));
    REQUIRE(termination.wave_to_start() == 1);
    CHECK(!termination.wave_to_start());  // one at a time
    termination.file(report(0, 1, 3, 1));
    termination.file(report(1, 1, 1, 3));
    CHECK(!termination.terminated());
    REQUIRE(termination.wave_to_start() == 2);
    termination.file(report(1, 2, 1, 3));
    termination.file(report(0, 2, 3, 1));
    CHECK(termination.terminated());
    CHECK(!termination.wave_to_start());
  }

  TEST_CASE("termination: a message that slips from a cell not yet asked to one asked already is caught") {
    Termination termination(2);
    termination.file(report(0, 0, 1, 0));
    termination.file(report(1, 0, 0, 1));
    REQUIRE(termination.wave_to_start() == 1);
    termination.file(report(0, 1, 1, 0));  // asked first, idle
    // Cell 1 meanwhile got work from a message of cell 0's past, sends one back, then answers: sums balance by accident.
    termination.file(report(1, 1, 1, 2));
    CHECK(!termination.terminated());
    REQUIRE(termination.wave_to_start() == 2);
    termination.file(report(0, 2, 2, 1));
    termination.file(report(1, 2, 1, 2));
    CHECK(!termination.terminated());  // the counts have moved: this is only the first look of the next pair
    REQUIRE(termination.wave_to_start() == 3);
    termination.file(report(0, 3, 2, 1));
    termination.file(report(1, 3, 1, 2));
    CHECK(termination.terminated());
  }

  TEST_CASE("termination: nothing is asked while counts differ or someone is busy") {
    Termination termination(2);
    termination.file(report(0, 0, 2, 0));
    termination.file(report(1, 0, 0, 1));
    CHECK(!termination.wave_to_start());
    termination.file(report(1, 0, 0, 2, false));
    CHECK(!termination.wave_to_start());
    termination.file(report(1, 0, 0, 2));
    REQUIRE(termination.wave_to_start() == 1);
    termination.file(report(0, 1, 2, 0, false));
    termination.file(report(1, 1, 0, 2));
    CHECK(!termination.terminated());
    CHECK(!termination.wave_to_start());  // cell 0 will say when it is idle
    termination.file(report(0, 0, 2, 0));
    CHECK(termination.wave_to_start() == 2);
  }

  TEST_CASE("termination: a reset voids the wave under way and the one before") {
    Termination termination(1);
    termination.file(report(0, 0, 0, 0));
    REQUIRE(termination.wave_to_start() == 1);
    termination.file(report(0, 1, 0, 0));
    REQUIRE(termination.wave_to_start() == 2);
    termination.reset();
    termination.file(report(0, 2, 0, 0));
    CHECK(!termination.terminated());
    REQUIRE(termination.wave_to_start() == 3);
    termination.file(report(0, 3, 0, 0));
    REQUIRE(termination.wave_to_start() == 4);
    termination.file(report(0, 4, 0, 0));
    CHECK(termination.terminated());
  }

  TEST_CASE("termination: reports that can not be are refused") {
    Termination termination(1);
    CHECK(!termination.file(report(1, 0, 0, 0)));  // no such cell
    CHECK(!termination.file(report(0, 5, 0, 0)));  // no such wave
    CHECK(termination.file(report(0, 0, 4, 4)));
    CHECK(!termination.file(report(0, 0, 3, 4)));  // counts never fall
    REQUIRE(termination.wave_to_start() == 1);
    CHECK(termination.file(report(0, 1, 4, 4)));
  }
}
