#include "io/text.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

TEST_SUITE("io") {
  TEST_CASE("text: patterns hold for whole names") {
    for (const char* pattern : {"desk", "*", "d*", "*k", "d?sk", "*e*k", "desk*", "????"})
      CHECK(is_of_pattern("desk", pattern));
    for (const char* pattern : {"", "des", "esk", "d?k", "?????", "*x*", "desk?"})
      CHECK_FALSE(is_of_pattern("desk", pattern));
    CHECK(is_of_pattern("aabab", "*ab"));
    CHECK(is_of_pattern("", "*"));
  }

  TEST_CASE("text: lines keep their numbers over line ends of all kinds and continuations") {
    Lines lines("a \r\n\nb \\\n c\\\r\nd\ne\\", true);
    const std::pair<const char*, std::uint32_t> expected[] = {{"a", 1}, {"", 2}, {"b    c   d", 3}, {"e\\", 6}};
    for (const auto& [text, number] : expected) {
      REQUIRE(lines.next());
      CHECK(lines.number() == number);
      std::string_view rest = lines.line(), wanted = text;
      for (;;) {
        const std::string_view word = next_word(rest);
        CHECK(word == next_word(wanted));
        if (word.empty()) break;
      }
    }
    CHECK_FALSE(lines.next());
  }

  TEST_CASE("text: numbers are whole words, correctly rounded") {
    double value = 0;
    CHECK(parse_number("+0.1", value));
    CHECK(value == 0.1);
    CHECK(parse_number("1e400", value));
    CHECK(std::isinf(value));
    CHECK(parse_number("1e-400", value));
    CHECK(value == 0);
    CHECK(parse_number("nan", value));
    for (const char* wrong : {"", "+", "+-1", "1x", "0x10", "1,5", "--1"}) CHECK_FALSE(parse_number(wrong, value));
    CHECK(parse_number(shortest_number(1.0 / 3), value));
    CHECK(value == 1.0 / 3);
    CHECK(shortest_number(-0.0) == "0");
  }

  TEST_CASE("text: what a message quotes is printable, short and valid UTF-8") {
    CHECK(in_quotes("Wände") == "'Wände'");
    CHECK(in_quotes("a\nb\x01\xff") == std::string("'a?b?") + "?'");
    CHECK(printable("\xC3") == "?");
    CHECK(in_quotes(std::string(100, 'x')).size() == 45);
  }

  TEST_CASE("text: devices, folders and files that are too long are refused") {
    const ScratchFolder folder;
    check_error(file_bytes("/dev/zero", 100), "/dev/zero", "is a device");
    check_error(file_bytes(folder / "", 100), folder / "", "is a folder");
    check_error(file_bytes(folder.write("a", std::string(3 << 20, 'x')), 2 << 20), folder / "a", "longer than 2 MiB");
    CHECK(*file_text(folder.write("b", "\xEF\xBB\xBFtext"), 100) == "text");
  }
}
