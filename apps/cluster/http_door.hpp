/// The door of the desk: takes connections, asks for certificates, and lets cpp-httplib read one request of each. The
/// library's own loop has neither deadlines nor bounds; this one knows who is inside and for how long.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "actors/link/socket.hpp"
#include "apps/cluster/desk_stream.hpp"
#include "apps/cluster/lab_service.hpp"

namespace lichthof::apps {

struct DoorLimits {
  /// Each is a thread; further ones are turned away, unless somebody has been silent for `idle_time`: then he goes.
  std::size_t connections = 128;
  std::chrono::milliseconds idle_time{1000};
  std::size_t head_bytes = 32768;              ///< request line and header fields
  std::chrono::milliseconds head_time{10000};  ///< for all of them, with the handshake
  std::chrono::milliseconds patience{10000};   ///< silence, or an answer that nobody takes
  std::uint64_t body_bytes = 1ull << 30;       ///< of the largest request
};

class HttpDoor : public httplib::Server {
 public:
  /// @param tls  none: everybody is `stranger`
  HttpDoor(actors::Socket listening, std::shared_ptr<const actors::TlsContext> tls, Caller stranger,
           const DoorLimits& limits);
  /// Closes. @pre close() was called, where handlers use what dies earlier
  ~HttpDoor() override;

  void open();
  /// Ends every connection and waits until all threads have left.
  void close();
  std::uint16_t port() const { return actors::local_port(listening_); }

  /// For handlers: whose request this is.
  static const Caller& caller();

 private:
  void accept_all();
  void admit(actors::Socket socket);
  void serve(int socket);
  void end_revoked();
  bool made_room();
  void has_asked(int socket);

  actors::Socket listening_;
  std::shared_ptr<const actors::TlsContext> tls_;
  Caller stranger_;
  DoorLimits limits_;
  std::thread acceptor_;
  std::mutex mutex_;
  std::condition_variable all_left_;
  std::set<int> inside_;                      ///< sockets that threads serve
  std::map<int, const DeskStream*> secured_;  ///< those of them with a certificate behind
  std::uint64_t revocations_seen_ = 0;        ///< by the acceptor
  struct Silent {
    int socket = -1;
    std::chrono::steady_clock::time_point since;
  };
  std::deque<Silent> silent_;  ///< have asked nothing yet, oldest first
  bool closing_ = false;
};

}  // namespace lichthof::apps
