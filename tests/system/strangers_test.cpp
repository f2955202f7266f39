/// Whoever reaches the ports of a lab and means no good: a real controller and a real node are sent what no peer would send.
///
/// LICHTHOF_STRANGERS=100000 sends so many instead of a few thousand, and LICHTHOF_SEED draws others.
#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdlib>
#include <deque>
#include <memory>
#include <thread>

#include "actors/cluster/cluster_messages.hpp"
#include "actors/link/frame.hpp"
#include "actors/link/socket.hpp"
#include "core/base/random.hpp"
#include "tests/system/small_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;
using namespace std::chrono_literals;
using actors::Bytes;

namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr std::uint64_t most_growth_bytes = 512u << 20;  // the sanitizer keeps for a while what has been freed
#else
constexpr std::uint64_t most_growth_bytes = 64u << 20;
#endif
constexpr std::uint64_t default_attacks = 3000;

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text && *text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// A socket of somebody who need not be let in.
class Stranger {
 public:
  explicit Stranger(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit = {5, 0}, moment = {0, 20'000};
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVTIMEO, &moment, sizeof moment);
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    sockaddr_in address = {};
    address.sin_family = AF_INET, address.sin_port = htons(port), address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    is_in_ = ::connect(socket_.fd(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  bool is_in() const { return is_in_; }
  void say(const Bytes& bytes) { (void)!::send(socket_.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// Waits a moment for the first words of an answer.
  void listen() {
    char bytes[4096];
    (void)!::recv(socket_.fd(), bytes, sizeof bytes, 0);
  }
  /// The other end gets a reset instead of an end.
  void leave_rudely() {
    const linger now = {1, 0};
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
  }

 private:
  actors::Socket socket_;
  bool is_in_ = false;
};

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

/// Draws what no peer would send.
class Malice {
 public:
  explicit Malice(std::uint64_t seed) : random_(seed) {}
  std::uint32_t below(std::uint32_t most) { return random_.below(most); }

  Bytes noise(std::uint32_t most) {
    Bytes bytes(below(most));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(below(256));
    return bytes;
  }
  Bytes damaged(Bytes bytes) {
    for (std::uint32_t i = 0, flips = 1 + below(4); i < flips && !bytes.empty(); ++i)
      bytes[below(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<std::uint8_t>(1 + below(255));
    return bytes;
  }
  Bytes cut_off(Bytes bytes) {
    bytes.resize(below(static_cast<std::uint32_t>(bytes.size())));
    return bytes;
  }

  /// To a port where processes talk to each other.
  Bytes for_link() {
    using namespace actors;
    const auto hello = [&](std::uint16_t protocol, const std::string& version) {
      return hello_frame({protocol, below(1000), 0, 1u << 20, version, {"ghost", Role::node}});
    };
    const Bytes good = hello(link_protocol, LICHTHOF_VERSION);
    Bytes bytes;
    switch (below(10)) {
      case 0:
        return noise(3000);
      case 1:
        return cut_off(good);
      case 2:
        return damaged(good);
      case 3:  // announces more than may come
        put_header(bytes, 0xffffffffu - below(1000), static_cast<FrameKind>(1 + below(8)));
        return bytes;
      case 4:
        return hello(static_cast<std::uint16_t>(2 + below(60000)), "99.9");
      case 5:  // the records of TLS
        bytes = noise(600);
        bytes.insert(bytes.begin(), {0x16, 3, 1, 2, 0, 1});
        return bytes;
      case 6:
        return bytes_of("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
      default:
        break;
    }
    // A whole session, as somebody may have recorded one, with faults from some point on.
    bytes = good;
    put_header(bytes, 0, FrameKind::ready);
    for (std::uint32_t i = 0, frames = 1 + below(6); i < frames; ++i) {
      Bytes payload = below(2) ? message() : noise(400);
      if (below(3) == 0) payload = damaged(std::move(payload));
      if (below(5) == 0) payload = cut_off(std::move(payload));
      put_header(bytes, payload.size(), below(3) ? FrameKind::control : FrameKind::bulk);
      bytes.insert(bytes.end(), payload.begin(), payload.end());
    }
    if (below(4) == 0) bytes.insert(bytes.end(), bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(below(50)));
    return bytes;
  }

  /// To the port for people.
  Bytes for_people() {
    const std::string host = "Host: localhost\r\n", document = host + "Content-Type: application/json\r\n";
    const auto post = [&](const std::string& path, const std::string& body) {
      return bytes_of("POST " + path + " HTTP/1.1\r\n" + document + "Content-Length: " + std::to_string(body.size()) +
                      "\r\n\r\n" + body);
    };
    const Bytes good = bytes_of("GET /v1/nodes HTTP/1.1\r\n" + host + "\r\n");
    switch (below(9)) {
      case 0:
        return noise(3000);
      case 1:
        return cut_off(good);
      case 2:
        return damaged(good);
      case 3:
        return bytes_of("GET /" + std::string(below(70000), 'a') + " HTTP/1.1\r\n" + host + "\r\n");
      case 4:
        return bytes_of("GET / HTTP/" + std::to_string(below(100)) + ".7\r\n" + host + "\r\n");
      case 5:  // promises a body that does not come
        return bytes_of("PUT /v1/scenes/" + std::string(64, 'a') + " HTTP/1.1\r\n" + host +
                        "Content-Type: application/octet-stream\r\nContent-Length: " + std::to_string(below(1u << 30)) +
                        "\r\n\r\nx");
      case 6:
        return post("/v1/jobs", std::string(below(2000), below(2) ? '[' : '{'));
      case 7: {
        const Bytes scene = noise(2000);
        Bytes bytes = bytes_of(
            "POST /v1/scenes HTTP/1.1\r\n" + host +
            "Content-Type: application/octet-stream\r\nContent-Length: " + std::to_string(scene.size()) + "\r\n\r\n");
        bytes.insert(bytes.end(), scene.begin(), scene.end());
        return bytes;
      }
      default:
        return for_link();
    }
  }

 private:
  /// One that a peer might have sent at another time.
  Bytes message() {
    using namespace actors;
    switch (below(6)) {
      case 0:
        return encode(ClusterMessage(Registration{"ghost", 4, 1ull << 33, 1e6}));
      case 1:
        return encode(ClusterMessage(NodeReport{0.5, 1, 1u << 30, 1u << 20, 1, 2, 3, {{"cell 0", JobId{1}, "idle"}}}));
      case 2:
        return encode(ClusterMessage(WantBlob{std::string(64, 'a'), below(1000)}));
      case 3:
        return encode(ClusterMessage(RunMessage{JobId{1 + below(3)}, Epoch{below(3)},
                                                static_cast<std::uint8_t>(below(5)), below(9), noise(300)}));
      case 4:
        return encode(ClusterMessage(Hosted{JobId{1 + below(3)}, Epoch{below(3)}}));
      default:
        return encode(ClusterMessage(ReleaseShare{JobId{1 + below(3)}, Epoch{9}}));
    }
  }

  Random random_;
};

/// Sends them, one after the other, to all three ports, and looks now and then whether honest people are served.
void endure(SmallLab& lab, std::uint64_t attacks, std::uint64_t seed) {
  Malice malice(seed);
  std::deque<Stranger> silent;  // connected, and never speaking
  const std::vector<std::uint64_t> before = lab.resident_bytes();
  std::vector<std::uint64_t> most = before;
  for (std::uint64_t i = 0; i < attacks; ++i) {
    const std::uint16_t port = i % 3 == 0 ? lab.people : i % 3 == 1 ? lab.nodes : lab.node;
    if (malice.below(20) == 0) {
      silent.emplace_back(port);
      if (silent.size() > 60) silent.pop_front();
      continue;
    }
    Stranger stranger(port);
    if (!stranger.is_in()) continue;
    stranger.say(port == lab.people ? malice.for_people() : malice.for_link());
    if (malice.below(8) == 0) stranger.listen();
    if (malice.below(2) == 0) stranger.leave_rudely();
    if (i % std::max<std::uint64_t>(1, attacks / 20) == 0) {
      REQUIRE(until([&] { return lab.node_count() >= 1; }));
      const std::vector<std::uint64_t> now = lab.resident_bytes();
      for (std::size_t k = 0; k < now.size(); ++k) most[k] = std::max(most[k], now[k]);
    }
  }
  silent.clear();
  // Ghosts that registered are noticed to be gone, the true node is there, and works.
  CHECK(until([&] { return lab.node_count() == 1; }));
  CHECK(lab.renders());
  const std::vector<std::uint64_t> after = lab.resident_bytes();
  for (std::size_t k = 0; k < before.size(); ++k) {
    const std::string who = k == 0 ? "controller" : "node";
    MESSAGE(who << ": " << (before[k] >> 20) << " MiB before, at most " << (most[k] >> 20) << " MiB under " << attacks
                << " attacks, " << (after[k] >> 20) << " MiB after a job");
    CHECK(most[k] < before[k] + most_growth_bytes);
  }
}

void allow_many_sockets() {
  rlimit limit = {};
  REQUIRE(::getrlimit(RLIMIT_NOFILE, &limit) == 0);
  limit.rlim_cur = limit.rlim_max;
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &limit) == 0);
}

}  // namespace

TEST_SUITE("strangers") {
  TEST_CASE("strangers: malformed frames and requests harm neither controller nor node") {
    SmallLab lab(false);
    REQUIRE(lab.renders());
    endure(lab, number_from("LICHTHOF_STRANGERS", default_attacks), number_from("LICHTHOF_SEED", 1));
  }

  TEST_CASE("strangers: nor where certificates are asked for") {
    SmallLab lab(true);
    REQUIRE(lab.renders());
    endure(lab, number_from("LICHTHOF_STRANGERS", default_attacks) / 3, number_from("LICHTHOF_SEED", 1) + 1);
  }

  TEST_CASE("strangers: 500 silent connections to each port keep nobody out") {
    allow_many_sockets();
    SmallLab lab(false);
    REQUIRE(lab.renders());
    const std::vector<std::uint64_t> before = lab.resident_bytes();
    std::deque<Stranger> idle;
    for (int i = 0; i < 500; ++i)
      for (const std::uint16_t port : {lab.people, lab.nodes, lab.node}) {
        idle.emplace_back(port);
        REQUIRE(idle.back().is_in());
      }
    const std::vector<std::uint64_t> during = lab.resident_bytes();
    CHECK(until([&] { return lab.node_count() == 1; }));
    lab.start_node("bert", free_port());
    CHECK(until([&] { return lab.node_count() == 2; }));
    CHECK(lab.renders());
    for (std::size_t k = 0; k < before.size(); ++k) CHECK(during[k] < before[k] + most_growth_bytes);
  }
}
