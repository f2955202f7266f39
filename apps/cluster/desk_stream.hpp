/// One connection of the desk or of its client, as cpp-httplib wants to see it: bytes in the clear or under TLS, never
/// waiting longer and never taking more than allowed. What a stranger can cost us is bounded here.
#pragma once

#include <httplib.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "actors/link/tls.hpp"

namespace lichthof::apps {

class DeskStream final : public httplib::Stream {
 public:
  using Duration = std::chrono::milliseconds;

  /// @param socket    connected; stays its owner's
  /// @param tls       none: in the clear
  /// @param patience  how long the other end may stay silent, or take nothing
  DeskStream(int socket, std::shared_ptr<const actors::TlsContext> tls, bool dialled, Duration patience);

  /// From now on at most so many bytes may be read, and within so long; before: none.
  void allow(std::size_t bytes, Duration whole);
  /// @returns false when the other end is nobody of this lab: failure() says why. In the clear: true at once
  bool shake_hands();
  /// After the last answer: lets it arrive although the other end may still be sending.
  void part();

  /// Who is there, by its certificate; none in the clear.
  std::optional<actors::Identity> peer() const;
  /// Whether its certificate has been taken back; from any thread, once hands were shaken.
  bool is_revoked() const { return tls_ && tls_->secured() && tls_->is_revoked(); }
  const std::string& failure() const { return failure_; }

  bool is_readable() const override { return true; }
  bool is_writable() const override { return failure_.empty(); }
  ssize_t read(char* to, std::size_t most) override;
  ssize_t write(const char* from, std::size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  void get_local_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  /// Only asked so as to refuse descriptors that select() cannot take; poll() takes any.
  socket_t socket() const override { return -1; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Moved { some, none, gone };

  Moved receive(char* to, std::size_t most, std::size_t& count);
  Moved send(const char* from, std::size_t size, std::size_t& count);
  bool wait(bool to_write, Clock::time_point until);
  bool fill();

  int socket_;
  std::optional<actors::TlsSession> tls_;
  Duration patience_;
  Clock::time_point until_;
  std::size_t allowed_ = 0;
  std::string buffer_;
  std::size_t at_ = 0;
  std::string failure_;
};

}  // namespace lichthof::apps
