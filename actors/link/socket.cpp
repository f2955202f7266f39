#include "actors/link/socket.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>

namespace lichthof::actors {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t max_dials = 256;
constexpr int backlog = 512;
/// How long a connecting thread looks away from whether it is still wanted.
constexpr int attention_ms = 50;

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

Error failed(const std::string& where, const std::string& what) { return {ErrorCode::io, where, what}; }

Expected<Addresses> addresses_of(const std::string& host, std::uint16_t port, int flags) {
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int problem =
      ::getaddrinfo(host.empty() ? nullptr : host.c_str(), std::to_string(port).c_str(), &hints, &found);
  if (problem != 0) return failed(endpoint(host, port), ::gai_strerror(problem));
  return Addresses(found, &::freeaddrinfo);
}

Socket new_socket(const addrinfo& address) {
  return Socket(::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

}  // namespace

Socket::~Socket() {
  if (fd_ >= 0) ::close(fd_);
}

bool is_loopback(const std::string& host) {
  in_addr v4 = {};
  in6_addr v6 = {};
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  if (::inet_pton(AF_INET6, host.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6);
  return host == "localhost";
}

std::string endpoint(const std::string& host, std::uint16_t port) {
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Expected<Socket> listening_socket(const std::string& host, std::uint16_t port) {
  const Expected<Addresses> addresses = addresses_of(host, port, AI_PASSIVE);
  if (!addresses) return addresses.error();
  int problem = EADDRNOTAVAIL;
  for (const addrinfo* address = addresses->get(); address; address = address->ai_next) {
    Socket socket = new_socket(*address);
    const int on = 1;
    if (socket.fd() >= 0 && ::setsockopt(socket.fd(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
        ::bind(socket.fd(), address->ai_addr, address->ai_addrlen) == 0 && ::listen(socket.fd(), backlog) == 0)
      return socket;
    problem = errno;
  }
  return failed(endpoint(host, port),
                std::string("cannot listen: ") + std::strerror(problem) +
                    (problem == EADDRINUSE ? "; stop the other program or choose another port" : ""));
}

std::uint16_t local_port(const Socket& socket) {
  sockaddr_storage address = {};
  socklen_t length = sizeof address;
  if (::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&address), &length) != 0) return 0;
  if (address.ss_family == AF_INET6) return ntohs(reinterpret_cast<const sockaddr_in6&>(address).sin6_port);
  return ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

std::string remote_host(int fd) {
  sockaddr_storage address = {};
  socklen_t length = sizeof address;
  char text[NI_MAXHOST] = {};
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&address), &length) != 0 ||
      ::getnameinfo(reinterpret_cast<const sockaddr*>(&address), length, text, sizeof text, nullptr, 0,
                    NI_NUMERICHOST) != 0)
    return {};
  return text;
}

struct Dialler::Shared {
  std::mutex mutex;
  std::condition_variable thread_ended;
  std::size_t threads = 0;
  std::atomic<bool> closed{false};

  Expected<Socket> connected(const addrinfo& address, SteadyClock::time_point deadline) const;
  Expected<Socket> dialled(const std::string& host, std::uint16_t port, std::chrono::milliseconds limit) const;
};

Expected<Socket> Dialler::Shared::connected(const addrinfo& address, SteadyClock::time_point deadline) const {
  Socket socket = new_socket(address);
  if (socket.fd() < 0) return failed("", std::strerror(errno));
  if (::connect(socket.fd(), address.ai_addr, address.ai_addrlen) == 0) return socket;
  if (errno != EINPROGRESS) return failed("", std::strerror(errno));
  while (!closed && SteadyClock::now() < deadline) {
    pollfd wait = {socket.fd(), POLLOUT, 0};
    if (::poll(&wait, 1, attention_ms) <= 0) continue;
    int problem = 0;
    socklen_t length = sizeof problem;
    ::getsockopt(socket.fd(), SOL_SOCKET, SO_ERROR, &problem, &length);
    if (problem != 0) return failed("", std::strerror(problem));
    return socket;
  }
  return failed("", "no answer in time");
}

Expected<Socket> Dialler::Shared::dialled(const std::string& host, std::uint16_t port,
                                          std::chrono::milliseconds limit) const {
  const auto deadline = SteadyClock::now() + limit;
  const Expected<Addresses> addresses = addresses_of(host, port, AI_ADDRCONFIG);
  if (!addresses) return addresses.error();
  Error last = failed("", "no such address");
  for (const addrinfo* address = addresses->get(); address && !closed; address = address->ai_next) {
    Expected<Socket> socket = connected(*address, deadline);
    if (socket) return socket;
    last = socket.error();
  }
  last.where = endpoint(host, port);
  return last;
}

Dialler::Dialler() : shared_(std::make_shared<Shared>()) {}

Dialler::~Dialler() {
  // Connecting threads look up every 50 ms; only one that waits for a name is left to itself.
  std::unique_lock lock(shared_->mutex);
  shared_->closed = true;
  shared_->thread_ended.wait_for(lock, std::chrono::milliseconds(4 * attention_ms),
                                 [this] { return shared_->threads == 0; });
}

void Dialler::dial(const std::string& host, std::uint16_t port, std::chrono::milliseconds limit, Answer answer) {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->threads >= max_dials) return answer(failed(endpoint(host, port), "too many dials at once"));
  try {
    std::thread([shared = shared_, host, port, limit, answer]() mutable {
      Expected<Socket> result = shared->dialled(host, port, limit);
      const std::lock_guard thread_lock(shared->mutex);
      if (!shared->closed) answer(std::move(result));
      answer = nullptr;
      --shared->threads;
      shared->thread_ended.notify_all();
    }).detach();
    ++shared_->threads;
  } catch (const std::system_error& error) {
    answer(failed(endpoint(host, port), std::string("no thread to dial with: ") + error.what()));
  }
}

}  // namespace lichthof::actors
