#include "apps/cluster/http_door.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>

namespace lichthof::apps {

namespace {

thread_local const Caller* current_caller = nullptr;

/// Slower than this, a body takes too long.
constexpr std::uint64_t least_bytes_per_ms = 64;
constexpr std::string_view full =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nConnection: close\r\nContent-Length: "
    "51\r\n\r\n"
    "{\"error\":\"too many connections; try again shortly\"}";

/// Length of the body a request announces; none when it makes no sense.
std::uint64_t announced_bytes(const httplib::Request& request) {
  const std::string text = request.get_header_value("Content-Length");
  std::uint64_t bytes = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), bytes);
  return problem == std::errc() && end == text.data() + text.size() ? bytes : 0;
}

}  // namespace

const Caller& HttpDoor::caller() { return *current_caller; }

HttpDoor::HttpDoor(actors::Socket listening, std::shared_ptr<const actors::TlsContext> tls, Caller stranger,
                   const DoorLimits& limits)
    : listening_(std::move(listening)), tls_(std::move(tls)), stranger_(std::move(stranger)), limits_(limits) {
  set_payload_max_length(limits.body_bytes);
}

HttpDoor::~HttpDoor() { close(); }

void HttpDoor::open() {
  svr_sock_ = listening_.fd();  // the library streams answers only while it believes to be listening
  ::fcntl(listening_.fd(), F_SETFL, ::fcntl(listening_.fd(), F_GETFL) | O_NONBLOCK);
  acceptor_ = std::thread([this] { accept_all(); });
}

void HttpDoor::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    for (const int socket : inside_) ::shutdown(socket, SHUT_RDWR);
  }
  if (acceptor_.joinable()) acceptor_.join();
  std::unique_lock lock(mutex_);
  all_left_.wait(lock, [this] { return inside_.empty(); });
  svr_sock_ = INVALID_SOCKET;
}

void HttpDoor::accept_all() {
  for (;;) {
    pollfd waiting{listening_.fd(), POLLIN, 0};
    const int ready = ::poll(&waiting, 1, 100);
    {
      const std::lock_guard lock(mutex_);
      if (closing_) return;
    }
    end_revoked();
    if (ready <= 0) continue;
    actors::Socket socket(::accept4(listening_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    if (socket.fd() >= 0)
      admit(std::move(socket));
    else  // no descriptor left: others must leave first
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

/// Who was let in before his certificate was taken back: dashboards stay connected for days.
void HttpDoor::end_revoked() {
  if (!tls_) return;
  const std::uint64_t generation = tls_->revocations().generation();
  if (std::exchange(revocations_seen_, generation) == generation) return;
  const std::lock_guard lock(mutex_);
  for (const auto& [fd, stream] : secured_)
    if (stream->is_revoked()) ::shutdown(fd, SHUT_RDWR);
}

void HttpDoor::admit(actors::Socket socket) {
  const std::lock_guard lock(mutex_);
  if (closing_) return;
  if (inside_.size() >= limits_.connections && !made_room()) {
    if (!tls_) (void)!::send(socket.fd(), full.data(), full.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return;
  }
  const int fd = socket.fd();
  try {
    inside_.insert(fd);
    silent_.push_back({fd, std::chrono::steady_clock::now()});
    std::thread([this, fd] { serve(fd); }).detach();
  } catch (const std::system_error&) {  // no thread left
    inside_.erase(fd);
    silent_.pop_back();
    return;
  }
  socket.release();
}

/// Whoever connects and says nothing shall not keep others out. Threads that are told to leave may take a moment: there are
/// never more than twice as many as allowed.
bool HttpDoor::made_room() {
  if (silent_.empty() || std::chrono::steady_clock::now() - silent_.front().since < limits_.idle_time) return false;
  ::shutdown(silent_.front().socket, SHUT_RDWR);
  silent_.pop_front();
  return inside_.size() < 2 * limits_.connections;
}

void HttpDoor::has_asked(int socket) {
  const std::lock_guard lock(mutex_);
  std::erase_if(silent_, [socket](const Silent& one) { return one.socket == socket; });
}

void HttpDoor::serve(int fd) {
  {
    DeskStream stream(fd, tls_, false, limits_.patience);
    stream.allow(limits_.head_bytes, limits_.head_time);
    if (stream.shake_hands()) {
      Caller caller = stranger_;
      if (const std::optional<actors::Identity> peer = stream.peer()) {
        caller = {peer->name, peer->role};
        const std::lock_guard lock(mutex_);
        secured_.emplace(fd, &stream);
      }
      current_caller = &caller;
      bool closed = false;
      // One request a connection: what a refused one left unread can't be taken for the next.
      process_request(stream, true, closed, [&](httplib::Request& request) {
        has_asked(fd);
        const std::uint64_t bytes = std::min(announced_bytes(request), limits_.body_bytes);
        stream.allow(bytes, limits_.patience + std::chrono::milliseconds(bytes / least_bytes_per_ms));
        // The library would wait for the end of the connection where HTTP knows no body.
        if (!request.has_header("Content-Length") && !request.has_header("Transfer-Encoding"))
          request.set_header("Content-Length", "0");
        request.ranges.clear();
        request.headers.erase("Range");
      });
      current_caller = nullptr;
    }
    {
      const std::lock_guard lock(mutex_);
      secured_.erase(fd);
    }
    stream.part();
  }
  has_asked(fd);
  const std::lock_guard lock(mutex_);
  inside_.erase(fd);
  actors::Socket closes(fd);
  // Under the lock: close() may return, and this door be gone, as soon as it is released.
  all_left_.notify_all();
}

}  // namespace lichthof::apps
