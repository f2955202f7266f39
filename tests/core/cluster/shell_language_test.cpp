#include "core/cluster/shell_language.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lichthof;

namespace {

ShellCommand only(std::string_view line) {
  const auto commands = shell_commands(line);
  INFO(line);
  REQUIRE(commands);
  REQUIRE(commands->size() == 1);
  return commands->front();
}

/// The error of a line, which must be one printable line.
std::string complaint(std::string_view line) {
  const auto commands = shell_commands(line);
  INFO(line);
  REQUIRE_FALSE(commands);
  CHECK(commands.error().code == ErrorCode::bad_input);
  const std::string text = commands.error().text();
  CHECK(std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }));
  return text;
}

bool says(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_SUITE("shell_language") {
  TEST_CASE("shell_language: each command with its arguments") {
    CHECK(only("nodes").verb == ShellVerb::nodes);
    CHECK(only("  jobs  ").job == 0);
    CHECK(only("jobs 12").job == 12);
    CHECK(only("cancel 7").verb == ShellVerb::cancel);
    CHECK(only("resume 7").verb == ShellVerb::resume);
    CHECK(only("watch 18446744073709551615").job == 18446744073709551615u);
    CHECK(only("log 3").verb == ShellVerb::log);
    const ShellCommand result = only("result 3 -o \"a b.png\"");
    CHECK(result.job == 3);
    CHECK(result.file == "a b.png");
    CHECK(only("drain lab7").on);
    CHECK_FALSE(only("drain lab7 off").on);
    CHECK(only("kick lab7").name == "lab7");
    CHECK(only("help").name.empty());
    CHECK(only("help watch").name == "watch");
    CHECK(only("quit").verb == ShellVerb::quit);
    CHECK(only("actors").verb == ShellVerb::actors);
    CHECK(only("methods").verb == ShellVerb::methods);
    const ShellCommand submit = only("submit room.obj -o room.png --camera '1,2,3; 4,5,6'");
    CHECK(submit.words == std::vector<std::string>{"room.obj", "-o", "room.png", "--camera", "1,2,3; 4,5,6"});
  }

  TEST_CASE("shell_language: a line holds several commands, none, or a comment") {
    const auto two = shell_commands("nodes; jobs 4 # the rest ; kick a");
    REQUIRE(two);
    REQUIRE(two->size() == 2);
    CHECK((*two)[1].job == 4);
    for (const char* nothing : {"", "   ", "# all of it", ";;", " ; # x"}) {
      const auto none = shell_commands(nothing);
      REQUIRE(none);
      CHECK(none->empty());
    }
    CHECK(only("kick a#b").name == "a#b");
  }

  TEST_CASE("shell_language: quotes and backslashes keep what would end a word") {
    CHECK(only("kick 'a b;#\\'").name == "a b;#\\");
    CHECK(only("kick \"a \\\" b\"").name == "a \" b");
    CHECK(only("kick a\\ b\\;c").name == "a b;c");
    CHECK(only("submit ''").words == std::vector<std::string>{""});
    says(complaint("kick 'a b"), "closing '");
    says(complaint("kick \"a b"), "closing \"");
  }

  TEST_CASE("shell_language: an error names what was expected") {
    says(complaint("frobnicate"), "no command 'frobnicate'; help lists them");
    says(complaint("nodes all"), "nothing may follow nodes, but 'all' does");
    says(complaint("cancel"), "expected: cancel ID");
    says(complaint("cancel x"), "'x' is no job's number; expected: cancel ID");
    says(complaint("cancel -1"), "is no job's number");
    says(complaint("cancel 0"), "is no job's number");
    says(complaint("cancel 99999999999999999999"), "is no job's number");
    says(complaint("watch 1 2"), "expected: watch ID");
    says(complaint("result 3"), "expected: result ID -o FILE");
    says(complaint("result 3 room.png"), "expected: result ID -o FILE");
    says(complaint("result x -o a.png"), "is no job's number");
    says(complaint("drain"), "expected: drain NODE [off]");
    says(complaint("drain a maybe"), "expected: drain NODE [off]");
    says(complaint("submit"), "expected: submit SCENE");
    says(complaint("help me"), "no command 'me'");
    says(complaint("nodes; jobs; wat\x1b[31m"), "no command 'wat?[31m'");
    says(complaint(std::string(5000, 'x')), "...'");
    says(complaint(std::string_view("a\0b", 3)), "zero byte");
  }

  TEST_CASE("shell_language: help lists every command, and tells about one") {
    const auto all = shell_help();
    REQUIRE(all);
    for (const char* verb : {"nodes", "jobs", "submit", "cancel", "resume", "watch", "result", "drain", "kick", "log",
                             "actors", "methods", "help", "quit"}) {
      says(*all, verb);
      const auto one = shell_help(verb);
      REQUIRE(one);
      CHECK(one->starts_with(verb));
    }
    CHECK_FALSE(shell_help("me"));
  }

  TEST_CASE("shell_language: completion offers what fits at the cursor") {
    const ShellNames names{{"1", "12", "3"}, {"lab1", "lab2", "my node"}};
    using Words = std::vector<std::string>;
    CHECK(completion("", names).candidates.size() == 14);
    CHECK(completion("re", names).candidates == Words{"resume", "result"});
    CHECK(completion("nodes; ca", names).candidates == Words{"cancel"});
    CHECK(completion("nodes; ca", names).start == 7);
    CHECK(completion("cancel ", names).candidates == Words{"1", "12", "3"});
    CHECK(completion("cancel 1", names).candidates == Words{"1", "12"});
    CHECK(completion("cancel 1 ", names).candidates.empty());
    CHECK(completion("kick l", names).candidates == Words{"lab1", "lab2"});
    CHECK(completion("kick m", names).candidates == Words{"\"my node\""});
    CHECK(completion("drain lab1 ", names).candidates == Words{"off", "on"});
    CHECK(completion("help w", names).candidates == Words{"watch"});
    CHECK(completion("frobnicate ", names).candidates.empty());
    CHECK(completion("result 3 ", names).candidates == Words{"-o"});
    CHECK(completion("result 3 -o ", names).files);
    CHECK(completion("submit ro", names).files);
    CHECK(completion("submit ro", names).start == 7);
    CHECK(completion("submit a.obj --ca", names).candidates == Words{"--camera"});
    CHECK(completion("submit a.obj --ce", names).candidates == Words{"--cells"});
    CHECK(completion("kick a # l", names).candidates.empty());
  }

  TEST_CASE("shell_language: whatever is typed, it ends in commands or an error") {
    // Every string of up to four of these characters.
    const std::string alphabet = "j \\;'\"#1";
    for (std::size_t code = 0; code < alphabet.size() * alphabet.size() * alphabet.size() * alphabet.size(); ++code) {
      std::string line = "jobs ";
      for (std::size_t rest = code, i = 0; i < 4; ++i, rest /= alphabet.size())
        line += alphabet[rest % alphabet.size()];
      const auto commands = shell_commands(line);
      if (!commands) CHECK_FALSE(commands.error().message.empty());
      CHECK(completion(line, {}).start <= line.size());
    }
  }
}
