/// All connections of a link: who may connect, who has said who he is, which of two connections to the same process stays,
/// who has fallen silent. Runs inside the link's broker, on the thread of CAF's multiplexer; nothing here blocks.
///
///     securing ──TLS──► greeting ──hello──► confirming ──ready──► up ──► over          (accepted)
///     securing ──TLS──► greeting ──hello─────────────────────────► up ──► over          (dialled)
///
/// Two processes that dial each other at the same time: only a dialler ends the greeting, so he decides. He keeps what is
/// already up; of two connections on their way, the one stays whose dialler has the smaller boot id, and both ends know that.
/// An acceptor refuses the greeting of somebody to whom a connection of his own dialling is up. So nothing is ever sent over
/// a connection that goes away.
#pragma once

#include <caf/all.hpp>
#include <caf/io/all.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "actors/link/link.hpp"
#include "actors/link/outbox.hpp"
#include "actors/link/socket.hpp"
#include "actors/link/stream.hpp"

namespace lichthof::actors {

struct LinkSetup {
  LinkOptions options;
  std::shared_ptr<const TlsContext> tls;
  std::uint64_t boot_id = 0;
  std::shared_ptr<LinkMonitor> monitor;
  caf::actor owner;
};

// From Link to its broker.
struct Listen {
  std::shared_ptr<Socket> socket;
  std::uint16_t port = 0;
};
struct Dial {
  std::string host;
  std::uint16_t port = 0;
};
struct Send {
  PeerId peer;
  FrameKind kind = FrameKind::control;
  SharedBytes bytes;
};
struct Consumed {
  PeerId peer;
  std::uint64_t credit = 0;
};
struct Close {
  PeerId peer;
  std::string reason;
};
struct StopLink {};
// From a dialling thread, and from the clock.
struct Dialled {
  Dial dial;
  std::shared_ptr<Socket> socket;  ///< null: it failed
  std::string reason;
};
struct Tick {};

class Switchboard {
 public:
  Switchboard(caf::io::broker& broker, const LinkSetup& setup);
  ~Switchboard();

  void listen(Socket socket, std::uint16_t port);
  void dial(const Dial& dial);
  void send(const Send& send);
  void consumed(const Consumed& consumed);
  void close(const Close& close);
  void stop();

  void accepted(Socket socket);
  void dialled(const Dialled& answer);
  void secured(std::int64_t id);
  void arrived(std::int64_t id, std::span<const std::uint8_t> bytes);
  void written(std::int64_t id, std::size_t remaining);
  void closed(std::int64_t id);
  void tick();

 private:
  using Clock = std::chrono::steady_clock;
  enum class Stage { securing, greeting, confirming, up, over };
  enum class Farewell { none, reason, control_and_reason };

  struct Connection {
    std::int64_t id = 0;
    bool dialled = false;
    Stage stage = Stage::securing;
    ScribePointer scribe;
    std::string host;
    std::uint16_t port = 0;  ///< that was dialled
    Clock::time_point opened, last_heard, last_sent;
    FrameReader reader;
    Hello peer;
    // When up:
    Outbox outbox;
    TokenBucket frames{1, 1};
    std::size_t unsent_bytes = 0;     ///< handed to the socket
    std::uint64_t held_credit = 0;    ///< bulk that has arrived and is not consumed
    std::uint64_t unsaid_credit = 0;  ///< consumed, but the peer has not been told
    bool blocked = false;
    std::shared_ptr<PeerCounters> counters;
  };
  /// Shared: a handler goes on for a moment with a connection that it has ended.
  using ConnectionPointer = std::shared_ptr<Connection>;
  struct Leaving {
    ScribePointer scribe;
    Clock::time_point since;
  };

  // Connections begin and end (switchboard.cpp).
  void open(Socket socket, bool is_dialled, const std::string& host, std::uint16_t port);
  ConnectionPointer connection(std::int64_t id) const;
  void end(const ConnectionPointer& c, const std::string& reason, Farewell farewell);
  void tell_end(const Connection& c, Stage was, const std::string& reason);
  void log_refusal(const std::string& line);
  void see_off();
  void end_revoked();
  void look_after(const ConnectionPointer& c, Clock::time_point now);

  // Who is it? (greeting.cpp)
  void greet(const ConnectionPointer& c);
  void greeted(const ConnectionPointer& c, const Frame& frame);
  bool is_welcome(const ConnectionPointer& c);
  bool decide_by_dialler(const ConnectionPointer& c);
  ConnectionPointer other(const Connection& c, const std::function<bool(const Connection&)>& condition) const;
  void confirmed(const ConnectionPointer& c);
  void bring_up(const ConnectionPointer& c);

  // Traffic (traffic.cpp)
  void take(const ConnectionPointer& c, const Frame& frame);
  void pump(Connection& c);
  bool end_if_slow(const ConnectionPointer& c);
  void push_own(Connection& c, Bytes frame);
  void write_now(Connection& c, const Bytes& frame);
  void tell_queue(Connection& c);

  caf::io::broker& broker_;
  LinkSetup setup_;
  const LinkOptions& options_ = setup_.options;
  std::map<std::int64_t, ConnectionPointer> connections_;
  std::set<std::int64_t> strangers_;  ///< accepted and not up, oldest first
  std::deque<Leaving> leaving_;       ///< ended, with bytes under way
  std::vector<caf::io::accept_handle> doormen_;
  std::int64_t last_id_ = 0;
  std::uint16_t own_port_ = 0;
  std::size_t up_ = 0;
  bool stopping_ = false;
  Clock::time_point last_tick_ = Clock::now();
  std::uint64_t revocations_seen_ = 0;
  TokenBucket refusals_{5, 20};
  std::size_t unlogged_refusals_ = 0;
  Dialler dialler_;
};

/// The reason for ending a connection to somebody who has another one.
inline constexpr const char* already_connected = "already connected";

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Listen)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Dial)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Send)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Consumed)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Close)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::StopLink)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Dialled)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Tick)
