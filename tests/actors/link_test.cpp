#include "actors/link/link.hpp"

#include <dirent.h>

#include <thread>

#include "tests/actors/link_process.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::test;

TEST_SUITE("actors") {
  TEST_CASE("link: frames cross in both directions, whole and in order") {
    Process a(named("a", Role::controller)), b(named("b"));
    const std::uint16_t port = a.listen();
    b.connect(port);
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    CHECK(a.ups[0].who.name == "b");
    CHECK(a.ups[0].who.role == Role::node);
    CHECK(a.ups[0].boot_id == b.link.boot_id());
    CHECK(a.ups[0].host == "127.0.0.1");
    CHECK_FALSE(a.ups[0].dialled);
    CHECK(b.ups[0].who.name == "a");
    CHECK(b.ups[0].port == port);
    CHECK(b.ups[0].dialled);
    for (std::uint8_t i = 0; i < 100; ++i) {
      a.link.send_control(a.peer(), bytes_of(i * 37u, i));
      b.link.send_bulk(b.peer(), bytes_of(i * 1013u, i));
    }
    b.link.send_bulk(b.peer(), bytes_of(8u << 20, 200));
    REQUIRE(b.until([&] { return b.frames.size() == 100; }));
    REQUIRE(a.until([&] { return a.frames.size() == 101; }));
    for (std::uint8_t i = 0; i < 100; ++i) {
      CHECK(*b.frames[i].bytes == Bytes(i * 37u, i));
      CHECK_FALSE(b.frames[i].bulk);
      CHECK(*a.frames[i].bytes == Bytes(i * 1013u, i));
      CHECK(a.frames[i].bulk);
    }
    CHECK(*a.frames[100].bytes == Bytes(8u << 20, 200));
    const auto peers = a.link.monitor().peers();
    REQUIRE(peers.size() == 1);
    CHECK(peers[0]->who.name == "b");
    CHECK(peers[0]->bytes_in > (8u << 20));
    CHECK(peers[0]->frames_out >= 100);
  }

  TEST_CASE("link: who closes gives the reason, after the control frames he had sent") {
    Process a(named("a")), b(named("b"));
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    for (int i = 0; i < 300; ++i) a.link.send_control(a.peer(), bytes_of(50000));
    a.link.close(a.peer(), "no more work");
    REQUIRE(b.until([&] { return !b.downs.empty(); }));
    CHECK(b.frames.size() == 300);
    CHECK(b.downs[0].reason == "left: no more work");
    REQUIRE(a.until([&] { return !a.downs.empty(); }));
    CHECK(a.downs[0].reason == "no more work");
    CHECK(a.link.monitor().peers().empty());
  }

  TEST_CASE("link: a dial that can not succeed fails with its reason") {
    Process a(named("a"));
    std::uint16_t free_port = 0;
    {
      const Expected<Socket> socket = listening_socket("127.0.0.1", 0);
      REQUIRE(socket);
      free_port = local_port(*socket);
    }
    CHECK(a.refusal(free_port) == "Connection refused");
    a.failures.clear();
    a.link.dial("no.such.host.invalid", 1);
    REQUIRE(a.until([&] { return !a.failures.empty(); }));
    CHECK(a.failures[0].host == "no.such.host.invalid");
    CHECK_FALSE(a.failures[0].reason.empty());
    CHECK(a.refusal(a.listen()).find("same process") != std::string::npos);
  }

  TEST_CASE("link: in the clear only loopback is listened on, unless insecure") {
    Process a(named("a"));
    check_error(a.link.listen("0.0.0.0", 0), "0.0.0.0:0", "without TLS");
    const std::uint16_t port = a.listen();
    check_error(a.link.listen("127.0.0.1", port), "127.0.0.1:" + std::to_string(port), "in use");
    check_error(a.link.listen("192.0.2.1", 0), "192.0.2.1:0", "without TLS");
    LinkOptions options = named("b");
    options.insecure = true;
    Process b(options);
    CHECK(b.link.listen("0.0.0.0", 0));
    check_error(b.link.listen("192.0.2.1", 0), "192.0.2.1:0", "cannot listen");
  }

  TEST_CASE("link: a role that is not allowed is refused by either end") {
    LinkOptions options = named("a", Role::controller);
    options.accepted_roles = {Role::node};
    Process a(options), viewer(named("v", Role::viewer));
    CHECK(viewer.refusal(a.listen()) == "refused by the peer: role viewer of v is not allowed here");
    CHECK(a.until([&] { return a.link.monitor().last_refusal().find("role viewer of v") != std::string::npos; }));
    // Nor does a mere user pass for a controller.
    Process user(named("u", Role::user)), node(named("n"));
    CHECK(node.refusal(user.listen()) == "role user of u is not allowed here");
  }

  TEST_CASE("link: two that dial each other at once have one connection, and no frame is lost") {
    for (int round = 0; round < 15; ++round) {
      Process a(named("a")), b(named("b"));
      const std::uint16_t port_a = a.listen(), port_b = b.listen();
      a.link.dial("127.0.0.1", port_b);
      if (round % 3 == 1) b.until([&, left = round % 5]() mutable { return left-- <= 0; });
      b.link.dial("127.0.0.1", port_a);
      REQUIRE(a.until([&] { return !a.ups.empty(); }));
      a.link.send_control(a.peer(), bytes_of(10));
      REQUIRE(b.until([&] { return !b.ups.empty(); }));
      b.link.send_control(b.peer(), bytes_of(10));
      REQUIRE(a.until([&] { return a.frames.size() == 1 && a.link.monitor().strangers == 0; }));
      REQUIRE(b.until([&] { return b.frames.size() == 1 && b.link.monitor().strangers == 0; }));
      // The dialler of the connection that went away knows why.
      REQUIRE(a.until([&] { return a.ups[0].dialled || a.failures.size() == 1; }));
      REQUIRE(b.until([&] { return b.ups[0].dialled || b.failures.size() == 1; }));
      CHECK(a.ups.size() == 1);
      CHECK(b.ups.size() == 1);
      CHECK(a.ups[0].dialled != b.ups[0].dialled);
      for (const Process* p : {&a, &b}) {
        CHECK(p->downs.empty());
        for (const DialFailed& failure : p->failures) CHECK(failure.connected);
        CHECK(p->link.monitor().peers().size() == 1);
      }
    }
  }

  TEST_CASE("link: who dials a second time hears that he is connected; who has lost the first replaces it") {
    Process a(named("a")), b(named("b"));
    const std::uint16_t port = a.listen();
    b.connect(port);
    b.link.dial("127.0.0.1", port);
    REQUIRE(b.until([&] { return !b.failures.empty(); }));
    CHECK(b.failures[0].connected);
    CHECK(b.downs.empty());
    BarePeer first(port), second(port);
    first.greet("bare", 7);
    REQUIRE(a.until([&] { return a.ups.size() == 2; }));
    second.greet("bare", 7);
    REQUIRE(a.until([&] { return a.ups.size() == 3; }));
    REQUIRE(a.downs.size() == 1);
    CHECK(a.downs[0].peer == a.ups[1].peer);
    CHECK(a.downs[0].reason == "replaced by a newer connection");
    CHECK(a.ups[2].peer > a.ups[1].peer);
    // Somebody of another name who greets with that number replaces nobody.
    BarePeer other(port);
    other.greet("other", 7);
    REQUIRE(a.until([&] { return a.ups.size() == 4; }));
    CHECK(a.downs.size() == 1);
  }

  TEST_CASE("link: bulk waits for credit, the queue is announced, control passes") {
    LinkOptions options = named("b");
    options.bulk_window = 1u << 20;
    Process a(named("a")), b(options);
    b.consumes = false;
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    constexpr std::size_t count = 400, size = 60000;
    for (std::size_t i = 0; i < count; ++i) a.link.send_bulk(a.peer(), bytes_of(size));
    REQUIRE(a.until([&] { return a.blocked == 1; }));
    a.link.send_control(a.peer(), bytes_of(11));
    REQUIRE(b.until([&] { return b.bytes_arrived(false) == 11; }));
    const std::size_t arrived = b.bytes_arrived(true);
    CHECK(arrived <= (1u << 20) + size);
    CHECK(a.ready == 0);
    CHECK(a.link.monitor().peers()[0]->queued_bytes > (8u << 20));
    b.consumes = true;
    for (const FrameArrived& frame : b.frames)
      if (frame.bulk) b.link.consumed(frame);
    REQUIRE(b.until([&] { return b.bytes_arrived(true) == count * size; }));
    REQUIRE(a.until([&] { return a.ready == 1; }));
    CHECK(a.blocked == 1);
    CHECK(a.downs.empty());
  }

  TEST_CASE("link: frames larger than the window cross one after the other, however many") {
    LinkOptions options = named("b");
    options.bulk_window = 1u << 16;
    Process a(named("a")), b(options);
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    constexpr std::size_t count = 12, size = 300'000;
    for (std::size_t i = 0; i < count; ++i) a.link.send_bulk(a.peer(), bytes_of(size));
    CHECK(b.until([&] { return b.bytes_arrived(true) == count * size; }));
    CHECK(a.downs.empty());
  }

  TEST_CASE("link: a frozen peer is down, also when bytes wait for it") {
    LinkOptions options = named("a");
    options.ping_interval = 100ms;
    options.silence_limit = 800ms;
    Process a(options);
    const std::uint16_t port = a.listen();
    BarePeer idle(port), loaded(port);
    idle.greet("idle", 1);
    loaded.greet("loaded", 2);
    REQUIRE(a.until([&] { return a.ups.size() == 2; }));
    for (int i = 0; i < 20; ++i) a.link.send_control(a.ups[1].peer, bytes_of(1u << 20));
    REQUIRE(a.until([&] { return a.downs.size() == 2; }));
    for (const LinkDown& down : a.downs) CHECK(down.reason == "silent for 0.8 s");
    // Who answers pings stays.
    BarePeer awake(port);
    awake.greet("awake", 3);
    for (int pings = 0; pings < 15;) {
      const Frame frame = awake.hear();
      REQUIRE(frame.kind == FrameKind::ping);
      REQUIRE(awake.say(number_frame(FrameKind::pong, *number_in(frame))));
      ++pings;
    }
    a.until([&] { return a.ups.size() == 3; });
    CHECK(a.downs.size() == 2);
  }

  TEST_CASE("link: a peer that takes nothing is too slow at the limit of its queue") {
    LinkOptions options = named("a");
    options.max_queued_bytes = 16u << 20;
    Process a(options);
    BarePeer slow(a.listen());
    slow.greet();
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    for (int i = 0; i < 40; ++i) a.link.send_control(a.peer(), bytes_of(1u << 20));
    REQUIRE(a.until([&] { return !a.downs.empty(); }));
    CHECK(a.downs[0].reason.find("too slow") == 0);
  }

  TEST_CASE("link: control that nobody takes is bounded at the receiver") {
    LinkOptions options = named("a");
    options.max_held_bytes = 8u << 20;
    Process a(options), b(named("b"));
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    for (int i = 0; i < 20; ++i) {  // let go of each time, nothing adds up
      b.link.send_control(b.peer(), bytes_of(1u << 20));
      REQUIRE(a.until([&] { return !a.frames.empty(); }));
      a.frames.clear();
    }
    CHECK(a.downs.empty());
    for (int i = 0; i < 20; ++i) b.link.send_control(b.peer(), bytes_of(1u << 20));
    REQUIRE(b.until([&] { return !b.downs.empty(); }));
    CHECK(b.downs[0].reason == "left: sends faster than it is listened to");
    REQUIRE(a.until([&] { return !a.downs.empty(); }));
    CHECK(a.frames.size() <= 10);
  }

  TEST_CASE("link: who sends more than he may is closed with the reason") {
    LinkOptions options = named("a");
    options.frames_per_second = 10;
    options.frames_at_once = 50;
    options.bulk_window = 100000;
    Process a(options);
    a.consumes = false;
    const std::uint16_t port = a.listen();
    const auto answer_to = [&](const Bytes& bytes) {
      BarePeer peer(port);
      peer.greet();
      peer.say(bytes);
      return peer.last_words();
    };
    Bytes pings, bulk, oversized, unknown, empty_bulk;
    for (int i = 0; i < 100; ++i) {
      const Bytes ping = number_frame(FrameKind::ping, 1);
      pings.insert(pings.end(), ping.begin(), ping.end());
    }
    for (int i = 0; i < 3; ++i) {
      put_header(bulk, 60000, FrameKind::bulk);
      bulk.resize(bulk.size() + 60000);
    }
    for (int i = 0; i < 1000; ++i) put_header(empty_bulk, 0, FrameKind::bulk);
    put_header(oversized, 0xffffffff, FrameKind::bulk);
    put_header(unknown, 3, FrameKind{99});
    CHECK(answer_to(pings) == "sends too many frames");
    CHECK(answer_to(bulk) == "sends more than its credit");
    CHECK(answer_to(empty_bulk) == "sends more than its credit");
    CHECK(answer_to(oversized) == "a frame of 4294967295 bytes where 8388608 are the most");
    CHECK(answer_to(unknown) == "a frame of unknown kind 99");
    CHECK(answer_to(hello_frame({link_protocol, 9, 0, 1, "test", {"x", Role::node}})) == "a second greeting");
    REQUIRE(a.until([&] { return a.downs.size() == 6; }));
  }

  TEST_CASE("link: orderly stop under load ends soon and leaves neither thread nor port") {
    const auto threads = [] {
      std::size_t count = 0;
      DIR* folder = ::opendir("/proc/self/task");
      while (::readdir(folder)) ++count;
      ::closedir(folder);
      return count;
    };
    const std::size_t before = threads();
    std::uint16_t port = 0;
    {
      Process a(named("a")), b(named("b")), c(named("c"));
      port = a.listen();
      b.connect(port);
      c.connect(port);
      BarePeer frozen(port);
      frozen.greet("frozen");
      REQUIRE(a.until([&] { return a.ups.size() == 3; }));
      for (int i = 0; i < 40; ++i)
        for (const LinkUp& up : a.ups) {
          a.link.send_control(up.peer, bytes_of(200000));
          a.link.send_bulk(up.peer, bytes_of(1000000));
        }
      a.link.dial("192.0.2.1", 9);  // answers nothing
      const auto start = std::chrono::steady_clock::now();
      a.link.stop();
      CHECK(a.has_ended());
      CHECK(std::chrono::steady_clock::now() - start < 5s);
      REQUIRE(b.until([&] { return !b.downs.empty(); }));
      CHECK(b.downs[0].reason == "left: a stops");
      CHECK(b.bytes_arrived(false) == 40 * 200000);
    }
    CHECK(listening_socket("127.0.0.1", port));
    const auto end = std::chrono::steady_clock::now() + patience;
    while (threads() > before && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(10ms);
    CHECK(threads() <= before);
  }

  TEST_CASE("link: it ends when it is killed, and when its owner ends") {
    Process b(named("b"));
    const std::uint16_t port = b.listen();
    SystemOptions options;
    options.network = true;
    SystemConfig config(options);
    caf::actor_system system(config);
    caf::scoped_actor self(system);
    for (const bool by_owner : {false, true}) {
      caf::actor owner = system.spawn([]() -> caf::behavior { return {[](const LinkUp&) {}}; });
      Expected<Link> link = Link::start(system, owner, named("a"));
      REQUIRE(link);
      REQUIRE(link->listen("127.0.0.1", 0));
      link->dial("127.0.0.1", port);
      const std::size_t ups = b.ups.size();
      REQUIRE(b.until([&] { return b.ups.size() > ups; }));
      self->monitor(link->actor());
      caf::anon_send_exit(by_owner ? owner : link->actor(), caf::exit_reason::kill);
      bool ended = false;
      self->receive([&](const caf::down_msg&) { ended = true; }, caf::after(patience) >> [] {});
      CHECK(ended);
      REQUIRE(b.until([&] { return b.downs.size() > ups; }));
      caf::anon_send_exit(owner, caf::exit_reason::kill);
    }
  }
}
