// Those who connect and do not behave.
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <random>

#include "tests/actors/link_process.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr std::size_t allowance_bytes = 512u << 20;  // the sanitizer keeps for a while what has been freed
#else
constexpr std::size_t allowance_bytes = 64u << 20;
#endif

/// Memory of this process (bytes).
std::size_t resident_bytes() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  unsigned long all = 0, resident = 0;
  if (!file || std::fscanf(file, "%lu %lu", &all, &resident) != 2) resident = 0;
  if (file) std::fclose(file);
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

TEST_SUITE("actors") {
  TEST_CASE("link: another version is told both versions") {
    Process a(named("a"));
    BarePeer peer(a.listen());
    REQUIRE(peer.say(hello_frame({link_protocol + 1, 5, 0, 1000, "9.9", {"new", Role::node}})));
    const std::string reason = peer.last_words();
    CHECK(reason.find("link protocol 2 (lichthof 9.9), this end 1 (lichthof test)") != std::string::npos);
    CHECK(a.until([&] { return a.link.monitor().last_refusal().find(reason) != std::string::npos; }));
  }

  TEST_CASE("link: whoever says nothing is closed at the deadline") {
    LinkOptions options = named("a");
    options.greeting_limit = 300ms;
    Process a(options);
    const std::uint16_t port = a.listen();
    BarePeer silent(port), half(port), halting(port);
    Bytes part = hello_frame({link_protocol, 5, 0, 1000, "test", {"x", Role::node}});
    halting.say(part);  // and never `ready`
    part.resize(20);
    half.say(part);
    CHECK(silent.last_words() == "no greeting within 0.3 s");
    CHECK(half.last_words() == "no greeting within 0.3 s");
    CHECK(halting.last_words() == "no greeting within 0.3 s");
    CHECK(a.until([&] { return a.link.monitor().strangers == 0; }));
    CHECK(a.ups.empty());
  }

  TEST_CASE("link: 500 idle connections keep nobody out, and their number is bounded") {
    Process a(named("a")), b(named("b"));
    const std::uint16_t port = a.listen();
    std::deque<BarePeer> idle;
    for (int i = 0; i < 500; ++i) {
      idle.emplace_back(port);
      REQUIRE(idle.back().connected());
    }
    REQUIRE(a.until([&] { return a.link.monitor().accepted == 500; }));
    CHECK(a.link.monitor().strangers <= 64);
    b.connect(port);
    REQUIRE(a.until([&] { return a.ups.size() == 1; }));
    CHECK(a.link.monitor().strangers <= 64);
    b.link.send_control(b.peer(), bytes_of(5));
    CHECK(a.until([&] { return a.frames.size() == 1; }));
  }

  TEST_CASE("link: when descriptors run out, strangers are turned away and what is up stays") {
    Process a(named("a")), b(named("b"));
    const std::uint16_t port = a.listen();
    b.connect(port);
    REQUIRE(a.until([&] { return a.ups.size() == 1; }));
    rlimit before = {}, low = {};
    REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
    low = before;
    {
      std::deque<BarePeer> many;
      // The sockets of this end are open already when the limit comes down.
      for (int i = 0; i < 60; ++i) many.emplace_back();
      low.rlim_cur = static_cast<rlim_t>(many.back().fd()) + 10;
      REQUIRE(::setrlimit(RLIMIT_NOFILE, &low) == 0);
      for (BarePeer& peer : many) peer.connect(port);
      std::size_t turned_away = 0;
      for (BarePeer& peer : many)
        if (turned_away < 40 && peer.is_closed()) ++turned_away;
      CHECK(turned_away == 40);
      b.link.send_control(b.peer(), bytes_of(3));
      CHECK(a.until([&] { return a.frames.size() == 1; }));
      REQUIRE(::setrlimit(RLIMIT_NOFILE, &before) == 0);
    }
    CHECK(a.until([&] { return a.link.monitor().strangers == 0; }));
    Process c(named("c"));
    c.connect(port);
    CHECK(a.downs.empty());
  }

  TEST_CASE("link: thousands of malformed greetings and frames do no harm") {
    Process a(named("a")), b(named("b"));
    const std::uint16_t port = a.listen();
    b.connect(port);
    const Bytes hello = hello_frame({link_protocol, 77, 0, 1000, "test", {"x", Role::node}});
    std::mt19937 random(1);
    const std::size_t before = resident_bytes();
    std::uint64_t connections = 0;
    for (int i = 0; i < 3000; ++i) {
      BarePeer peer(port);
      REQUIRE(peer.connected());
      ++connections;
      Bytes bytes = hello;
      switch (i % 8) {
        case 0:  // noise
          bytes.resize(random() % 3000);
          for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
          break;
        case 1:
          bytes.resize(random() % hello.size());
          break;  // cut off
        case 2:   // announces four gigabytes
          bytes.clear();
          put_header(bytes, 0xffffffff, FrameKind::control);
          break;
        case 3:
          bytes[frame_header_bytes + 8] = 9;
          break;  // another version
        case 4:
          bytes.insert(bytes.end(), hello.begin(), hello.end());
          break;
        case 5:  // no greeting first
          bytes.clear();
          put_header(bytes, 4, FrameKind::control);
          bytes.resize(bytes.size() + 4);
          break;
        case 6:
          bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
          break;
        case 7:  // a greeting that goes on for ever
          bytes.clear();
          put_header(bytes, 1000, FrameKind::hello);
          bytes.resize(100000);
          break;
      }
      peer.say(bytes);
      if (i % 100 == 0) b.link.send_control(b.peer(), bytes_of(100));
    }
    REQUIRE(a.until([&] { return a.link.monitor().accepted == connections + 1; }));
    CHECK(a.link.monitor().strangers <= 64);
    REQUIRE(a.until([&] { return a.frames.size() == 30; }));
    CHECK(a.ups.size() == 1);
    CHECK(a.downs.empty());
    CHECK(resident_bytes() < before + allowance_bytes);
    Process c(named("c"));
    c.connect(port);
  }

  TEST_CASE("link: thousands of malformed frames after a greeting end one connection each") {
    Process a(named("a"));
    const std::uint16_t port = a.listen();
    std::mt19937 random(2);
    constexpr std::size_t rounds = 500;
    for (std::size_t i = 0; i < rounds; ++i) {
      BarePeer peer(port);
      peer.greet("bare", i + 1);
      Bytes noise(20 + random() % 2000);
      for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
      if (i % 2 == 0) noise[4] = static_cast<std::uint8_t>(random() % 9);  // a kind that there is
      noise[3] |= 1;                                                       // never a length that is allowed
      peer.say(noise);
    }
    REQUIRE(a.until([&] { return a.downs.size() == rounds; }));
    CHECK(a.ups.size() == rounds);
    CHECK(a.link.monitor().peers().empty());
  }

  TEST_CASE("frame: cut into single bytes it arrives whole") {
    Bytes stream;
    for (std::size_t i = 0; i < 50; ++i) {
      put_header(stream, i, i % 2 ? FrameKind::control : FrameKind::bulk);
      stream.insert(stream.end(), i, static_cast<std::uint8_t>(i));
    }
    FrameReader reader;
    reader.admit(100);
    std::size_t frames = 0;
    for (const std::uint8_t byte : stream) {
      std::span<const std::uint8_t> arrived(&byte, 1);
      const auto frame = reader.next(arrived);
      REQUIRE(frame);
      if (!*frame) continue;
      CHECK(*(*frame)->bytes == Bytes(frames, static_cast<std::uint8_t>(frames)));
      ++frames;
    }
    CHECK(frames == 50);
  }
}
