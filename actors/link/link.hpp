/// The link between the processes of a cluster: blocks of bytes over one TCP connection per pair, on mutual TLS or in the
/// clear. CAF's own protocol is not spoken: whoever reaches it may end actors and processes. Here a peer can say hello, send
/// frames that somebody else decodes, and nothing else; what he can make this process hold is bounded.
///
///     owner ──► dial listen send consumed close stop          (any thread; nothing blocks)
///     owner ◄── LinkUp FrameArrived ... LinkDown, DialFailed  (in this order for each peer)
///
/// Control frames overtake bulk and are never dropped; who does not take them falls too far behind and is down. Bulk frames
/// wait for credit: the receiving owner says what it has consumed. What is sent to a peer that is down is lost.
#pragma once

#include <atomic>
#include <caf/all.hpp>
#include <chrono>
#include <compare>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "actors/link/frame.hpp"
#include "actors/link/role.hpp"
#include "actors/link/tls.hpp"
#include "core/base/expected.hpp"

namespace lichthof::actors {

/// One connection that has been up; the next one to the same process has another number.
struct PeerId {
  std::uint64_t value = 0;
  auto operator<=>(const PeerId&) const = default;
};

struct LinkOptions {
  Identity own;                 ///< under TLS the certificate decides instead
  std::string version;          ///< of the program
  std::optional<TlsFiles> tls;  ///< none: in the clear, and only on loopback
  bool insecure = false;        ///< in the clear on any address
  std::vector<Role> accepted_roles{Role::node, Role::controller, Role::user, Role::viewer};
  std::vector<Role> dialled_roles{Role::node, Role::controller};  ///< who may answer when we dial

  std::chrono::milliseconds dial_limit{5000};      ///< looking up a name and connecting
  std::chrono::milliseconds greeting_limit{5000};  ///< from the connection to the greeting, TLS included
  std::chrono::milliseconds ping_interval{1000};
  std::chrono::milliseconds silence_limit{6000};   ///< after that a peer is down
  std::chrono::milliseconds farewell_limit{1000};  ///< for what is under way when a connection ends

  std::size_t max_strangers = 64;  ///< accepted, but not greeted yet; the oldest has to go
  std::size_t max_peers = 1024;
  std::size_t max_frame_bytes = 8u << 20;
  std::size_t max_queued_bytes = 64u << 20;  ///< to one peer; beyond, it is too slow
  std::size_t max_held_bytes = 256u << 20;   ///< control frames from one peer that the owner has not let go of
  std::size_t blocked_bytes = 8u << 20;      ///< in the queue: LinkBlocked above it, LinkReady below its half
  std::size_t socket_bytes = 1u << 20;       ///< handed to the socket at once
  std::uint32_t bulk_window = 4u << 20;      ///< what we hold of a peer's bulk before it must wait
  double frames_per_second = 20000, frames_at_once = 40000;  ///< all kinds but bulk, from one peer
};

// ---- What the owner is told -------------------------------------------------------------------------------------------

struct LinkUp {
  PeerId peer;
  Identity who;
  std::uint64_t boot_id = 0;  ///< the same as before: the process has not been restarted in between
  std::string version;
  std::string host;        ///< numeric when it dialled, else as we dialled it
  std::uint16_t port = 0;  ///< it listens there; 0: nowhere
  bool dialled = false;    ///< by us
};
struct LinkDown {
  PeerId peer;
  std::string reason;
};
struct DialFailed {
  std::string host;
  std::uint16_t port = 0;
  std::string reason;
  bool connected = false;  ///< it is connected, or about to be, by another connection
};
struct FrameArrived {
  PeerId peer;
  bool bulk = false;  ///< then it must be named to Link::consumed
  SharedBytes bytes;
};
/// Much waits to be sent: stop producing until LinkReady.
struct LinkBlocked {
  PeerId peer;
};
struct LinkReady {
  PeerId peer;
};

// ---- What monitoring may read at any time -----------------------------------------------------------------------------

struct PeerCounters {
  PeerId peer;
  Identity who;
  std::string host;
  std::atomic<std::uint64_t> bytes_in{0}, bytes_out{0}, frames_in{0}, frames_out{0};
  std::atomic<std::uint64_t> held_bytes{0};     ///< of control that has arrived and that somebody still holds
  std::atomic<std::uint64_t> queued_bytes{0};   ///< towards the peer
  std::atomic<std::uint64_t> round_trip_us{0};  ///< of the last ping; 0: none yet
};

class LinkMonitor {
 public:
  std::vector<std::shared_ptr<const PeerCounters>> peers() const;
  std::atomic<std::uint64_t> strangers{0};  ///< connections that have not greeted yet
  std::atomic<std::uint64_t> accepted{0}, refused{0};
  /// Why the last one was refused, or a dial of ours failed.
  std::string last_refusal() const;

  // For the link.
  void add(std::shared_ptr<const PeerCounters> peer);
  void remove(PeerId peer);
  void refuse(const std::string& why);

 private:
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<const PeerCounters>> peers_;
  std::string last_refusal_;
};

// ---- The handle -------------------------------------------------------------------------------------------------------

/// A copy is the same link. The actor behind it ends after stop(), or with its owner.
class Link {
 public:
  /// @pre   the system has the network module (SystemOptions::network)
  /// @error bad_input: what is wrong with a file of TLS
  static Expected<Link> start(caf::actor_system& system, const caf::actor& owner, LinkOptions options);

  /// @param port  0: any free one
  /// @returns the port
  /// @error bad_input: in the clear beyond loopback; io: not an address of this machine, port in use
  Expected<std::uint16_t> listen(const std::string& host, std::uint16_t port) const;

  /// Answered by LinkUp or DialFailed.
  void dial(const std::string& host, std::uint16_t port) const;
  /// @pre bytes not null and not longer than max_frame_bytes
  void send_control(PeerId peer, SharedBytes bytes) const { send(peer, FrameKind::control, std::move(bytes)); }
  void send_bulk(PeerId peer, SharedBytes bytes) const { send(peer, FrameKind::bulk, std::move(bytes)); }
  /// Bulk that has arrived has been dealt with: the peer may send as much again.
  void consumed(PeerId peer, std::size_t bytes, std::size_t frames = 1) const;
  void consumed(const FrameArrived& frame) const { consumed(frame.peer, frame.bytes->size()); }
  /// Control frames still go out, then the reason; the owner is told LinkDown.
  void close(PeerId peer, const std::string& reason) const;
  /// The same with everybody, but nothing more is told; then the actor ends.
  void stop() const;

  const Identity& own() const { return own_; }
  std::uint64_t boot_id() const { return boot_id_; }
  const LinkMonitor& monitor() const { return *monitor_; }
  const caf::actor& actor() const { return actor_; }

 private:
  void send(PeerId peer, FrameKind kind, SharedBytes bytes) const;

  Identity own_;
  std::uint64_t boot_id_ = 0;
  bool encrypted_ = false, insecure_ = false;
  std::size_t max_frame_bytes_ = 0;
  std::shared_ptr<LinkMonitor> monitor_;
  caf::actor actor_;
};

}  // namespace lichthof::actors

// These never leave the process.
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::LinkUp)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::LinkDown)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::DialFailed)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::FrameArrived)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::LinkBlocked)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::LinkReady)
