#include "apps/cluster/desk_stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace lichthof::apps {

namespace {

constexpr std::size_t buffer_bytes = 65536;
/// Slower than this, somebody who takes an answer is taken for stalled.
constexpr std::size_t least_bytes_per_ms = 16;
/// What is still read of a request that has been refused.
constexpr std::size_t most_leftover_bytes = 4u << 20;

}  // namespace

DeskStream::DeskStream(int socket, std::shared_ptr<const actors::TlsContext> tls, bool dialled, Duration patience)
    : socket_(socket), patience_(patience), until_(Clock::now() + patience) {
  ::fcntl(socket, F_SETFL, ::fcntl(socket, F_GETFL) | O_NONBLOCK);
  if (tls) tls_.emplace(std::move(tls), socket, dialled);
}

void DeskStream::allow(std::size_t bytes, Duration whole) {
  allowed_ = bytes;
  until_ = Clock::now() + whole;
}

std::optional<actors::Identity> DeskStream::peer() const {
  if (!tls_ || !tls_->secured()) return std::nullopt;
  return tls_->peer();
}

bool DeskStream::wait(bool to_write, Clock::time_point until) {
  for (;;) {
    const auto left = std::chrono::duration_cast<Duration>(std::min(until, Clock::now() + patience_) - Clock::now());
    pollfd waiting{socket_, static_cast<short>(to_write ? POLLOUT : POLLIN), 0};
    const int ready = left.count() <= 0 ? 0 : ::poll(&waiting, 1, static_cast<int>(left.count()) + 1);
    if (ready > 0) return true;
    if (ready == 0) {
      failure_ = to_write ? "the other end takes nothing" : "no answer in time";
      return false;
    }
    if (errno != EINTR) return false;
  }
}

bool DeskStream::shake_hands() {
  while (tls_) {
    const actors::TlsSession::Progress progress = tls_->shake_hands();
    if (progress == actors::TlsSession::Progress::done) return true;
    if (progress == actors::TlsSession::Progress::failed) {
      failure_ = tls_->failure().empty() ? "the other end closed the connection" : tls_->failure();
      return false;
    }
    if (!wait(tls_->wants_to_write(), until_)) return false;
  }
  return true;
}

DeskStream::Moved DeskStream::receive(char* to, std::size_t most, std::size_t& count) {
  if (tls_) {
    const actors::TlsSession::Progress progress = tls_->read(to, most, count);
    if (progress == actors::TlsSession::Progress::failed && !tls_->failure().empty()) failure_ = tls_->failure();
    return progress == actors::TlsSession::Progress::done    ? Moved::some
           : progress == actors::TlsSession::Progress::again ? Moved::none
                                                             : Moved::gone;
  }
  const ssize_t got = ::recv(socket_, to, most, 0);
  count = got > 0 ? static_cast<std::size_t>(got) : 0;
  if (got > 0) return Moved::some;
  return got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) ? Moved::none : Moved::gone;
}

DeskStream::Moved DeskStream::send(const char* from, std::size_t size, std::size_t& count) {
  if (tls_) {
    const actors::TlsSession::Progress progress = tls_->write(from, size, count);
    return progress == actors::TlsSession::Progress::done    ? Moved::some
           : progress == actors::TlsSession::Progress::again ? Moved::none
                                                             : Moved::gone;
  }
  const ssize_t sent = ::send(socket_, from, size, MSG_NOSIGNAL);
  count = sent > 0 ? static_cast<std::size_t>(sent) : 0;
  if (sent > 0) return Moved::some;
  return sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) ? Moved::none : Moved::gone;
}

bool DeskStream::fill() {
  buffer_.resize(buffer_bytes);
  at_ = 0;
  for (;;) {
    std::size_t count = 0;
    const Moved moved = receive(buffer_.data(), buffer_.size(), count);
    buffer_.resize(moved == Moved::some ? count : moved == Moved::gone ? 0 : buffer_bytes);
    if (moved == Moved::some) return true;
    if (moved == Moved::gone) return false;
    if (!wait(tls_ && tls_->wants_to_write(), until_)) {
      buffer_.clear();
      return false;
    }
  }
}

ssize_t DeskStream::read(char* to, std::size_t most) {
  if (allowed_ == 0) return 0;
  if (at_ == buffer_.size() && !fill()) return failure_.empty() ? 0 : -1;
  const std::size_t count = std::min({most, buffer_.size() - at_, allowed_});
  std::memcpy(to, buffer_.data() + at_, count);
  at_ += count;
  allowed_ -= count;
  return static_cast<ssize_t>(count);
}

ssize_t DeskStream::write(const char* from, std::size_t size) {
  const Clock::time_point until = Clock::now() + patience_ + Duration(size / least_bytes_per_ms);
  std::size_t sent = 0;
  while (sent < size) {
    std::size_t count = 0;
    const Moved moved = send(from + sent, size - sent, count);
    sent += count;
    if (moved == Moved::gone) return -1;
    if (moved == Moved::none && !wait(!tls_ || tls_->wants_to_write(), until)) return -1;
    if (sent < size && Clock::now() > until) {
      failure_ = "the other end is too slow";
      return -1;
    }
  }
  return static_cast<ssize_t>(size);
}

void DeskStream::part() {
  // Closing with unread bytes would reset the connection, and the answer might be lost on the way.
  ::shutdown(socket_, SHUT_WR);
  const Clock::time_point until = Clock::now() + std::min(patience_, Duration(2000));
  char leftover[4096];
  for (std::size_t bytes = 0; bytes < most_leftover_bytes && Clock::now() < until;) {
    const ssize_t got = ::recv(socket_, leftover, sizeof leftover, 0);
    if (got > 0)
      bytes += static_cast<std::size_t>(got);
    else if (got == 0 || (errno != EAGAIN && errno != EINTR) || !wait(false, until))
      return;
  }
}

}  // namespace lichthof::apps
