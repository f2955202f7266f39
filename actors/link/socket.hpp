/// Plain TCP sockets: listening, and connecting without keeping anybody waiting.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/base/expected.hpp"

namespace lichthof::actors {

/// Owns a descriptor.
class Socket {
 public:
  explicit Socket(int fd = -1) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  Socket(const Socket&) = delete;
  ~Socket();
  int fd() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

bool is_loopback(const std::string& host);

/// "HOST:PORT", with brackets around an IPv6 address.
std::string endpoint(const std::string& host, std::uint16_t port);

/// @param port  0: any free one
/// @error bad_input naming the endpoint: no such address here, port in use
Expected<Socket> listening_socket(const std::string& host, std::uint16_t port);
std::uint16_t local_port(const Socket& socket);
/// Numeric address of the other end; empty when it has gone.
std::string remote_host(int fd);

/// Connects on threads of its own: names are looked up by a library that blocks.
class Dialler {
 public:
  using Answer = std::function<void(Expected<Socket>)>;

  Dialler();
  Dialler(const Dialler&) = delete;
  /// No answer is given afterwards. A thread that waits for a name server may outlive this; it touches nothing then.
  ~Dialler();

  /// @param answer  called once, on another thread or at once: a connected socket that does not block, or one clear error
  void dial(const std::string& host, std::uint16_t port, std::chrono::milliseconds limit, Answer answer);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace lichthof::actors
