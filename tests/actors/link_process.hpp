/// One process of a cluster inside a test program: an actor system of its own with a link, and the list of what its owner
/// was told. Also peers that misbehave, made of bare sockets.
#pragma once

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "actors/link/link.hpp"
#include "actors/link/socket.hpp"
#include "actors/system_config.hpp"

namespace lichthof::test {

using namespace lichthof::actors;
using namespace std::chrono_literals;

/// Long enough for a busy machine; nothing waits so long unless it is broken.
constexpr auto patience = 30s;

inline SharedBytes bytes_of(std::size_t count, std::uint8_t value = 7) {
  return std::make_shared<const Bytes>(count, value);
}

inline LinkOptions named(const std::string& name, Role role = Role::node) {
  LinkOptions options;
  options.own = {name, role};
  options.version = "test";
  return options;
}

class Process {
 public:
  explicit Process(const LinkOptions& options) : link(started(options)) { spdlog::set_level(spdlog::level::off); }
  ~Process() {
    link.stop();
    CHECK(has_ended());
  }
  Process(const Process&) = delete;

  std::uint16_t listen() {
    const Expected<std::uint16_t> port = link.listen("127.0.0.1", 0);
    REQUIRE(port);
    return *port;
  }
  /// Takes messages until the condition holds. @returns whether it ever did
  bool until(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      take_one();
    }
    return true;
  }
  void connect(std::uint16_t port) {
    const std::size_t before = ups.size();
    link.dial("127.0.0.1", port);
    REQUIRE(until([&] { return ups.size() > before || !failures.empty(); }));
    INFO((failures.empty() ? "" : failures[0].reason));
    REQUIRE(ups.size() > before);
  }
  /// Why a dial failed. @pre it fails
  std::string refusal(std::uint16_t port) {
    failures.clear();
    link.dial("127.0.0.1", port);
    REQUIRE(until([&] { return !failures.empty() || !ups.empty(); }));
    REQUIRE(ups.empty());
    return failures[0].reason;
  }
  bool has_ended() {
    bool ended = false;
    self->monitor(link.actor());
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!ended && std::chrono::steady_clock::now() < end)
      self->receive([&](const caf::down_msg&) { ended = true; }, [](const LinkUp&) {}, [](const LinkDown&) {},
                    [](const DialFailed&) {}, [](const FrameArrived&) {}, [](const LinkBlocked&) {},
                    [](const LinkReady&) {}, caf::after(20ms) >> [] {});
    return ended;
  }
  PeerId peer() const { return ups.back().peer; }
  std::size_t bytes_arrived(bool bulk) const {
    std::size_t sum = 0;
    for (const FrameArrived& frame : frames)
      if (frame.bulk == bulk) sum += frame.bytes->size();
    return sum;
  }

 private:
  Link started(const LinkOptions& options) {
    Expected<Link> made = Link::start(system, caf::actor_cast<caf::actor>(self), options);
    INFO((made ? "" : made.error().text()));
    REQUIRE(made);
    return *made;
  }
  void take_one() {
    self->receive([&](const LinkUp& m) { ups.push_back(m); }, [&](const LinkDown& m) { downs.push_back(m); },
                  [&](const DialFailed& m) { failures.push_back(m); },
                  [&](const FrameArrived& m) {
                    frames.push_back(m);
                    if (consumes && m.bulk) link.consumed(m);
                  },
                  [&](const LinkBlocked&) { ++blocked; }, [&](const LinkReady&) { ++ready; },
                  caf::after(10ms) >> [] {});
  }
  static SystemConfig network() {
    SystemOptions options;
    options.network = true;
    return SystemConfig(options);
  }

 public:
  SystemConfig config = network();
  caf::actor_system system{config};
  caf::scoped_actor self{system};
  std::vector<LinkUp> ups;
  std::vector<LinkDown> downs;
  std::vector<DialFailed> failures;
  std::vector<FrameArrived> frames;
  int blocked = 0, ready = 0;
  bool consumes = true;
  Link link;
};

/// A client of bare TCP.
class BarePeer {
 public:
  BarePeer() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit = {30, 0};
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  }
  explicit BarePeer(std::uint16_t port) : BarePeer() { connect(port); }
  void connect(std::uint16_t port) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_.fd(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  /// Whether the other end closes within a moment.
  bool is_closed() const {
    pollfd wait = {socket_.fd(), POLLIN, 0};
    char byte = 0;
    return ::poll(&wait, 1, 500) == 1 && ::recv(socket_.fd(), &byte, 1, MSG_PEEK) <= 0;
  }
  bool connected() const { return connected_; }
  int fd() const { return socket_.fd(); }
  bool say(const Bytes& bytes) {
    return ::send(socket_.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  /// The next frame; kind 0 when the connection has ended.
  Frame hear() {
    for (;;) {
      Expected<std::optional<Frame>> frame = reader_.next(unread_);
      REQUIRE(frame);
      if (*frame) return **frame;
      buffer_.resize(4096);
      const ssize_t count = ::recv(socket_.fd(), buffer_.data(), buffer_.size(), 0);
      if (count <= 0) return {FrameKind{}, std::make_shared<Bytes>()};
      unread_ = {buffer_.data(), static_cast<std::size_t>(count)};
    }
  }
  /// Hears until the other end closes. @returns the reason it gave
  std::string last_words() {
    std::string reason;
    for (Frame frame = hear(); frame.kind != FrameKind{}; frame = hear())
      if (frame.kind == FrameKind::goodbye) reason = reason_in(frame);
    return reason;
  }
  /// Greets as one should.
  void greet(const std::string& name = "bare", std::uint64_t boot_id = 42) {
    REQUIRE(say(hello_frame({link_protocol, boot_id, 0, 1u << 20, "test", {name, Role::node}})));
    REQUIRE(hear().kind == FrameKind::hello);
    Bytes ready;
    put_header(ready, 0, FrameKind::ready);
    REQUIRE(say(ready));
    reader_.admit(8u << 20);
  }

 private:
  Socket socket_;
  bool connected_ = false;
  FrameReader reader_;
  Bytes buffer_;
  std::span<const std::uint8_t> unread_;
};

}  // namespace lichthof::test
