#include <openssl/err.h>
#include <openssl/ssl.h>

#include <ctime>
#include <thread>

#include "actors/link/keys.hpp"
#include "tests/actors/link_process.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

/// A lab with its authority.
struct Lab {
  Lab() { REQUIRE(create_authority(keys)); }
  /// A certificate of this lab for a process.
  LinkOptions options(const std::string& name, Role role = Role::node) {
    issue(name, role);
    LinkOptions options;
    options.version = "test";
    options.tls = TlsFiles{keys + "/ca.crt", keys + "/" + name + ".crt", keys + "/" + name + ".key"};
    return options;
  }
  void issue(const std::string& name, Role role, const Validity& validity = issued_validity) {
    REQUIRE(issue_certificate(keys, {name, role}, validity));
  }
  ScratchFolder folder;
  std::string keys = folder / "keys";
};

/// What a client of bare OpenSSL learns from a port: with this certificate, or with none.
std::string answer_to(std::uint16_t port, const std::string& certificate_stem, int version = TLS1_3_VERSION) {
  BarePeer tcp(port);
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL_CTX_set_max_proto_version(context, version);
  if (!certificate_stem.empty()) {
    SSL_CTX_use_certificate_file(context, (certificate_stem + ".crt").c_str(), SSL_FILETYPE_PEM);
    SSL_CTX_use_PrivateKey_file(context, (certificate_stem + ".key").c_str(), SSL_FILETYPE_PEM);
  }
  SSL* ssl = SSL_new(context);
  SSL_set_fd(ssl, tcp.fd());
  char byte = 0;
  ERR_clear_error();
  std::string answer = "accepted";
  if (SSL_connect(ssl) != 1 || SSL_read(ssl, &byte, 1) <= 0) {
    const char* words = ERR_reason_error_string(ERR_peek_last_error());
    answer = words ? words : "closed";
  }
  SSL_free(ssl);
  SSL_CTX_free(context);
  return answer;
}

bool contains(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_SUITE("actors") {
  TEST_CASE("link over TLS: certificates say who is who, and frames of any size cross") {
    Lab lab;
    LinkOptions boastful = lab.options("b");
    boastful.own = {"a-king", Role::controller};
    Process a(lab.options("a", Role::controller)), b(boastful);
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    CHECK(a.ups[0].who.name == "b");
    CHECK(a.ups[0].who.role == Role::node);
    CHECK(b.ups[0].who.name == "a");
    CHECK(b.ups[0].who.role == Role::controller);
    std::size_t sum = 0;
    for (std::size_t size : {0u, 1u, 16383u, 16384u, 16385u, 65536u, 1000000u, 8u << 20}) {
      a.link.send_bulk(a.peer(), bytes_of(size, 3));
      b.link.send_control(b.peer(), bytes_of(size, 4));
      sum += size;
    }
    REQUIRE(b.until([&] { return b.frames.size() == 8; }));
    REQUIRE(a.until([&] { return a.frames.size() == 8; }));
    CHECK(b.bytes_arrived(true) == sum);
    CHECK(a.bytes_arrived(false) == sum);
    CHECK(*b.frames[7].bytes == Bytes(8u << 20, 3));
  }

  TEST_CASE("link over TLS: much crosses both ways at once") {
    Lab lab;
    Process a(lab.options("a")), b(lab.options("b"));
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    constexpr std::size_t count = 600, size = 100000;
    for (std::size_t i = 0; i < count; ++i) {
      a.link.send_bulk(a.peer(), bytes_of(size));
      b.link.send_bulk(b.peer(), bytes_of(size));
    }
    const auto all_there = [&](Process& p) { return p.bytes_arrived(true) == count * size; };
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!(all_there(a) && all_there(b)) && std::chrono::steady_clock::now() < end)
      for (Process* p : {&a, &b}) p->until([first = true]() mutable { return !std::exchange(first, false); });
    CHECK(all_there(a));
    CHECK(all_there(b));
  }

  TEST_CASE("link over TLS: nobody waits by turning round") {
    Lab lab;
    Process a(lab.options("a")), b(lab.options("b"));
    const std::uint16_t port = a.listen();
    b.connect(port);
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    // Enough to fill the buffers of the system, so that TLS has waited for room.
    for (int i = 0; i < 40; ++i) a.link.send_control(a.peer(), bytes_of(1u << 20));
    REQUIRE(b.until([&] { return b.frames.size() == 40; }));
    BarePeer silent(port), half(port);
    half.say({0x16, 3, 1, 2, 0, 1});
    const auto wall = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    std::this_thread::sleep_for(1s);
    const double cpu_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
    // A loop that waits costs a few milliseconds, one that spins all of a core.
    CHECK(cpu_s < 0.5 * wall_s);
  }

  TEST_CASE("link over TLS: strangers are refused, each with the reason at both ends") {
    Lab lab, other_lab;
    Process a(lab.options("a"));
    const std::uint16_t port = a.listen();
    const auto& monitor = a.link.monitor();
    auto refusal_here = [&, refused = std::uint64_t{0}](const std::string& part) mutable {
      REQUIRE(a.until([&] { return monitor.refused > refused; }));
      refused = monitor.refused;
      contains(monitor.last_refusal(), part);
    };
    {
      Process foreign(other_lab.options("f"));
      contains(foreign.refusal(port), "certificate");
      refusal_here("certificate");
    }
    contains(answer_to(port, ""), "certificate required");
    refusal_here("did not return a certificate");
    lab.issue("old", Role::node, {-2 * day_s, -day_s});
    contains(answer_to(port, lab.keys + "/old"), "certificate expired");
    refusal_here("expired");
    contains(answer_to(port, other_lab.keys + "/f"), "unknown ca");
    refusal_here("refused");
    contains(answer_to(port, lab.keys + "/ca"), "");
    refusal_here("");
    contains(answer_to(port, lab.keys + "/a", TLS1_2_VERSION), "version");
    refusal_here("TLS");
    {
      Process plain(named("p"));
      contains(plain.refusal(port), "TLS");
      refusal_here("does not speak TLS");
    }
    CHECK(a.ups.empty());
    CHECK(a.until([&] { return monitor.strangers == 0; }));
    Process good(lab.options("good"));
    good.connect(port);
  }

  TEST_CASE("link over TLS: a role that is not allowed, and a port in the clear, are refused") {
    Lab lab;
    LinkOptions options = lab.options("a");
    options.accepted_roles = {Role::controller};
    Process a(options), b(lab.options("b")), plain(named("p"));
    contains(b.refusal(a.listen()), "role node of b is not allowed here");
    contains(b.refusal(plain.listen()), "TLS");
    CHECK(plain.until([&] { return plain.link.monitor().last_refusal().find("speaks TLS") != std::string::npos; }));
  }

  TEST_CASE("link over TLS: whoever never finishes the handshake is closed, and 500 of them keep nobody out") {
    Lab lab;
    LinkOptions options = lab.options("a");
    options.greeting_limit = 1000ms;
    Process a(options), b(lab.options("b"));
    const std::uint16_t port = a.listen();
    std::deque<BarePeer> idle;
    for (int i = 0; i < 500; ++i) {
      idle.emplace_back(port);
      if (i % 2) idle.back().say({0x16, 3, 1, 2, 0, 1});
    }
    REQUIRE(a.until([&] { return a.link.monitor().accepted == 500; }));
    CHECK(a.link.monitor().strangers <= 64);
    b.connect(port);
    CHECK(idle.back().last_words().empty());
    REQUIRE(a.until([&] { return a.link.monitor().strangers == 0 && !a.ups.empty(); }));
    CHECK(a.ups.size() == 1);
    b.link.send_control(b.peer(), bytes_of(9));
    CHECK(a.until([&] { return a.frames.size() == 1; }));
  }

  TEST_CASE("link over TLS: who is revoked is parted with at once, and let in no more") {
    Lab lab;
    Process a(lab.options("a", Role::controller)), b(lab.options("b")), c(lab.options("c"));
    const std::uint16_t port = a.listen();
    b.connect(port), c.connect(port);
    REQUIRE(a.until([&] { return a.ups.size() == 2; }));
    const auto before = std::chrono::steady_clock::now();
    REQUIRE(revoke_certificate(lab.keys, "b"));
    REQUIRE(a.until([&] { return !a.downs.empty(); }));
    CHECK(std::chrono::steady_clock::now() - before < 10s);  // a tick is 0.1 s
    contains(a.downs[0].reason, "its certificate has been revoked");
    REQUIRE(b.until([&] { return !b.downs.empty(); }));
    contains(b.downs[0].reason, "revoked");
    b.ups.clear();
    contains(b.refusal(port), "revoked");
    // The refused one may hear of it before the other end has written it down.
    CHECK(a.until([&] { return a.link.monitor().last_refusal().find("certificate revoked") != std::string::npos; }));
    contains(answer_to(port, lab.keys + "/b"), "revoked");
    // Whoever is not in the list stays, and another certificate of the same name opens again.
    CHECK(a.downs.size() == 1);
    c.link.send_control(c.peer(), bytes_of(9));
    CHECK(a.until([&] { return a.frames.size() == 1; }));
    Process successor(lab.options("b"));
    successor.connect(port);
  }

  TEST_CASE("link over TLS: a dialler also asks whether the other end is revoked") {
    Lab lab;
    Process a(lab.options("a", Role::controller)), b(lab.options("b"));
    const std::uint16_t port = a.listen();
    REQUIRE(revoke_certificate(lab.keys, "a"));
    contains(b.refusal(port), "certificate revoked");
  }

  TEST_CASE("link over TLS: a damaged list, a foreign one, and a list that is gone free nobody") {
    Lab lab, other_lab;
    Process a(lab.options("a", Role::controller)), b(lab.options("b"));
    const std::uint16_t port = a.listen();
    REQUIRE(revoke_certificate(lab.keys, "b"));
    contains(b.refusal(port), "revoked");
    other_lab.issue("x", Role::node);
    REQUIRE(revoke_certificate(other_lab.keys, "x"));
    const std::string list = lab.keys + "/ca.crl";
    for (const std::string& text : {std::string("nonsense"), other_lab.folder.read("keys/ca.crl"), std::string()}) {
      lab.folder.write("keys/ca.crl", text);
      contains(b.refusal(port), "revoked");
    }
    test::check_error(TlsContext::load(*lab.options("c").tls), list, "no list of revoked certificates");
    std::filesystem::remove(list);
    contains(b.refusal(port), "revoked");
    Process good(lab.options("good"));
    good.connect(port);
  }

  TEST_CASE("link over TLS: a frozen peer with bytes under way holds up neither the others nor the end") {
    Lab lab;
    LinkOptions options = lab.options("a");
    options.silence_limit = 1000ms;
    options.ping_interval = 200ms;
    Process a(options), b(lab.options("b"));
    b.connect(a.listen());
    REQUIRE(a.until([&] { return !a.ups.empty(); }));
    for (int i = 0; i < 100; ++i) a.link.send_control(a.peer(), bytes_of(500000));
    REQUIRE(b.until([&] { return b.frames.size() == 100; }));
    for (int i = 0; i < 100; ++i) b.link.send_bulk(b.peer(), bytes_of(500000));
    b.link.stop();
    REQUIRE(a.until([&] { return !a.downs.empty(); }));
    contains(a.downs[0].reason, "left: b stops");
  }
}
