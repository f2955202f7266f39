#include "actors/link/stream.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <caf/policy/tcp.hpp>
#include <cerrno>

namespace lichthof::actors {

namespace {

using caf::io::network::operation;
using caf::io::network::rw_state;

/// So much is encrypted in one go before others get their turn.
constexpr std::size_t write_turn_bytes = 256u << 10;

/// What CAF's stream asks of a protocol. Success with no bytes means: wait for the socket.
struct TlsPolicy {
  TlsSession& session;

  rw_state read_some(std::size_t& count, int, void* to, std::size_t most) {
    count = 0;
    if (!session.secured()) {
      const auto shaken = session.shake_hands();
      if (shaken != TlsSession::Progress::done)
        return shaken == TlsSession::Progress::failed ? rw_state::failure : rw_state::success;
    }
    return session.read(to, most, count) == TlsSession::Progress::failed ? rw_state::failure : rw_state::success;
  }

  rw_state write_some(std::size_t& count, int, const void* from, std::size_t most) {
    count = 0;
    if (!session.secured())
      return session.shake_hands() == TlsSession::Progress::failed ? rw_state::failure : rw_state::success;
    auto progress = TlsSession::Progress::done;
    while (count < most && count < write_turn_bytes && progress == TlsSession::Progress::done) {
      std::size_t piece = 0;
      progress = session.write(static_cast<const char*>(from) + count, most - count, piece);
      count += piece;
    }
    return progress == TlsSession::Progress::failed && count == 0 ? rw_state::failure : rw_state::success;
  }

  /// Decrypted bytes that wait inside OpenSSL wake nobody up.
  bool must_read_more(int, std::size_t) { return session.unread(); }
};

}  // namespace

void Stream::handle_event(operation op) {
  if (!session_) {
    caf::policy::tcp policy;
    return handle_event_impl(op, policy);
  }
  const bool was_secured = session_->secured();
  TlsPolicy policy{*session_};
  handle_event_impl(op, policy);
  if (session_->wants_to_write()) force_empty_write(manager_);
  if (!was_secured && session_->secured() && manager_->parent())
    caf::anon_send(caf::actor_cast<caf::actor>(manager_->parent()),
                   Secured{static_cast<Scribe*>(manager_)->hdl().id()});
}

Scribe::Scribe(caf::io::network::default_multiplexer& multiplexer, std::int64_t id, Socket socket,
               std::unique_ptr<TlsSession> session)
    : scribe(caf::io::connection_handle::from_int(id)), stream_(multiplexer, socket.release(), std::move(session)) {
  stream_.own(this);
}

Scribe::~Scribe() = default;

void Scribe::configure_read(caf::io::receive_policy::config config) {
  stream_.configure_read(config);
  if (started_) return;
  started_ = true;
  stream_.start(this);
}

void Scribe::begin() {
  // An empty write makes the loop call us once: the first words of the handshake are said there.
  if (stream_.session()) stream_.force_empty_write(this);
}

void Scribe::finish() {
  if (detached()) return;
  stream_.graceful_shutdown();
  detach(&stream_.backend(), false);
}

void Scribe::abort() {
  ::shutdown(stream_.fd(), SHUT_RDWR);
  stream_.graceful_shutdown();
  detach(&stream_.backend(), false);
}

void Scribe::drain() {
  char rest[4096];
  for (int i = 0; i < 64 && ::recv(stream_.fd(), rest, sizeof rest, MSG_DONTWAIT) > 0; ++i) {
  }
}

Doorman::Doorman(caf::io::network::default_multiplexer& multiplexer, std::int64_t id, Socket socket)
    : doorman(caf::io::accept_handle::from_int(id)), acceptor_(multiplexer, socket.release()) {}

bool Doorman::new_connection() {
  Socket socket(acceptor_.accepted_socket());
  if (detached()) return false;
  caf::anon_send(caf::actor_cast<caf::actor>(parent()), Accepted{std::make_shared<Socket>(std::move(socket))});
  return true;
}

void Doorman::graceful_shutdown() {
  acceptor_.graceful_shutdown();
  detach(&acceptor_.backend(), false);
}

Doorman::Acceptor::Acceptor(caf::io::network::default_multiplexer& multiplexer, int fd)
    : acceptor(multiplexer, fd), reserve_(::open("/dev/null", O_RDONLY | O_CLOEXEC)) {}

bool Doorman::Acceptor::try_accept(int& accepted, int fd) {
  accepted = ::accept4(fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (accepted >= 0) return true;
  if (errno == EMFILE || errno == ENFILE) {
    reserve_ = Socket();
    Socket turned_away(::accept4(fd, nullptr, nullptr, SOCK_CLOEXEC));
    turned_away = Socket();
    reserve_ = Socket(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  }
  return false;
}

}  // namespace lichthof::actors
