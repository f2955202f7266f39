/// Connections and listeners as CAF's multiplexer sees them: its event loop moves the bytes, through TLS where a session is
/// given. CAF's own classes can not be used, because they leave out two things that a daemon needs: to stop waiting for a
/// peer that takes nothing (an actor system with unsent bytes never ends), and to survive running out of descriptors.
///
/// Handles are numbered and never used twice; CAF's are descriptors, which the system soon gives to the next connection.
#pragma once

#include <caf/all.hpp>
#include <caf/io/all.hpp>
#include <caf/io/network/acceptor.hpp>
#include <caf/io/network/default_multiplexer.hpp>
#include <caf/io/network/stream.hpp>
#include <memory>
#include <string>

#include "actors/link/socket.hpp"
#include "actors/link/tls.hpp"

namespace lichthof::actors {

/// To the broker: somebody has connected.
struct Accepted {
  std::shared_ptr<Socket> socket;
};
/// To the broker: the TLS handshake of this connection is through.
struct Secured {
  std::int64_t connection = 0;
};

/// The bytes of one connection.
class Stream : public caf::io::network::stream {
 public:
  /// @param session  null: plain TCP
  Stream(caf::io::network::default_multiplexer& multiplexer, int fd, std::unique_ptr<TlsSession> session)
      : stream(multiplexer, fd), session_(std::move(session)) {}
  void handle_event(caf::io::network::operation operation) override;
  bool writing() const { return state_.writing; }
  TlsSession* session() { return session_.get(); }
  void own(caf::io::network::stream_manager* manager) { manager_ = manager; }

 private:
  std::unique_ptr<TlsSession> session_;
  caf::io::network::stream_manager* manager_ = nullptr;  ///< whose member this is
};

class Scribe : public caf::io::scribe {
 public:
  Scribe(caf::io::network::default_multiplexer& multiplexer, std::int64_t id, Socket socket,
         std::unique_ptr<TlsSession> session);
  ~Scribe() override;

  /// Under TLS: begins the handshake when we dialled. @pre the broker has it, and configure_read was called
  void begin();
  /// Detaches from the broker without a message; what has been written still goes out, nothing more is read.
  void finish();
  /// The same, but what has been written is lost.
  void abort();
  /// Takes what came after the end and forgets it: closing with unread bytes would cancel the ones under way to the peer.
  void drain();
  /// Nothing is left to be sent.
  bool idle() const { return !stream_.writing(); }
  TlsSession* session() { return stream_.session(); }

  void configure_read(caf::io::receive_policy::config config) override;
  void ack_writes(bool enable) override { stream_.ack_writes(enable); }
  std::vector<char>& wr_buf() override { return stream_.wr_buf(); }
  std::vector<char>& rd_buf() override { return stream_.rd_buf(); }
  void graceful_shutdown() override { abort(); }
  void flush() override { stream_.flush(this); }
  std::string addr() const override { return remote_host(stream_.fd()); }
  std::uint16_t port() const override { return 0; }
  void add_to_loop() override { stream_.activate(this); }
  void remove_from_loop() override { stream_.passivate(); }

 private:
  bool started_ = false;
  Stream stream_;
};
using ScribePointer = caf::intrusive_ptr<Scribe>;

/// Accepts connections and tells its broker; more descriptors than there are do not make it spin.
class Doorman : public caf::io::doorman {
 public:
  Doorman(caf::io::network::default_multiplexer& multiplexer, std::int64_t id, Socket socket);
  bool new_connection() override;
  void graceful_shutdown() override;
  void launch() override { acceptor_.start(this); }
  std::string addr() const override { return {}; }
  std::uint16_t port() const override { return 0; }
  void add_to_loop() override { acceptor_.activate(this); }
  void remove_from_loop() override { acceptor_.passivate(); }

 private:
  class Acceptor : public caf::io::network::acceptor {
   public:
    Acceptor(caf::io::network::default_multiplexer& multiplexer, int fd);
    void handle_event(caf::io::network::operation operation) override { handle_event_impl(operation, *this); }
    bool try_accept(int& accepted, int fd);

   private:
    Socket reserve_;  ///< given up for a moment to accept and close what can not be served
  };
  Acceptor acceptor_;
};

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Accepted)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Secured)
