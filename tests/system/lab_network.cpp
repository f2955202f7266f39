#include "tests/system/lab_network.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <map>
#include <utility>

#include "core/base/random.hpp"

namespace lichthof::testing {

namespace {

constexpr std::uint32_t network = 0x0a4d0000;          // 10.77.0.0, host 0 is .1
constexpr std::size_t longest_queue = 4096;            // packets; what comes on top is lost, as in any switch
constexpr std::int64_t longest_sleep_ns = 20'000'000;  // of the carrier, so that it notices the end

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

ifreq interface(const char* name) {
  ifreq request{};
  std::strncpy(request.ifr_name, name, IFNAMSIZ - 1);
  return request;
}

void put_address(ifreq& request, std::uint32_t address) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  in.sin_addr.s_addr = htonl(address);
  std::memcpy(&request.ifr_addr, &in, sizeof in);
}

bool bring(int control, const char* name, bool is_up) {
  ifreq request = interface(name);
  if (::ioctl(control, SIOCGIFFLAGS, &request) != 0) return false;
  const int flags = is_up ? request.ifr_flags | IFF_UP : request.ifr_flags & ~IFF_UP;
  request.ifr_flags = static_cast<short>(flags);
  return ::ioctl(control, SIOCSIFFLAGS, &request) == 0;
}

struct Packet {
  std::int64_t due_ns = 0;
  std::vector<char> bytes;
};

}  // namespace

Expected<std::unique_ptr<LabNetwork>> LabNetwork::make(std::size_t hosts) {
  std::unique_ptr<LabNetwork> made(new LabNetwork(hosts));
  for (std::size_t host = 0; host < hosts; ++host)
    if (Status opened = made->open(host); !opened) return opened.error();
  made->carrier_ = std::thread([raw = made.get()] { raw->carry(); });
  return made;
}

LabNetwork::~LabNetwork() {
  stopping_ = true;
  if (carrier_.joinable()) carrier_.join();
  for (const Host& host : hosts_)
    for (const int file : {host.space, host.wire, host.control})
      if (file >= 0) ::close(file);
}

/// A namespace belongs to a thread, and outlives it by its open file.
Status LabNetwork::open(std::size_t index) {
  Host& host = hosts_[index];
  Status status = Done{};
  const auto failed = [&](const char* what) {
    status = Error{ErrorCode::io, what, std::string("is not permitted: ") + std::strerror(errno)};
  };
  std::thread([&] {
    if (::unshare(CLONE_NEWNET) != 0) return failed("a network namespace");
    host.space = ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    host.control = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    host.wire = ::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (host.space < 0 || host.control < 0 || host.wire < 0) return failed("/dev/net/tun");
    ifreq request = interface("lab0");
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    if (::ioctl(host.wire, TUNSETIFF, &request) != 0) return failed("an interface");
    ifreq address = interface("lab0"), mask = interface("lab0");
    put_address(address, network + 1 + static_cast<std::uint32_t>(index));
    put_address(mask, 0xffffff00);
    if (::ioctl(host.control, SIOCSIFADDR, &address) != 0 || ::ioctl(host.control, SIOCSIFNETMASK, &mask) != 0 ||
        !bring(host.control, "lab0", true) || !bring(host.control, "lo", true))
      return failed("an address");
  }).join();
  return status;
}

std::string LabNetwork::address(std::size_t host) const { return "10.77.0." + std::to_string(host + 1); }

void LabNetwork::delay(double delay_ms, double jitter_ms) {
  delay_ns_ = static_cast<std::int64_t>(1e6 * delay_ms), jitter_ns_ = static_cast<std::int64_t>(1e6 * jitter_ms);
}

void LabNetwork::set_link(std::size_t host, bool is_up) {
  hosts_[host].is_up = is_up;
  bring(hosts_[host].control, "lab0", is_up);
}

void LabNetwork::carry() {
  Random random(10);
  std::map<std::pair<std::size_t, std::size_t>, std::deque<Packet>> ways;  // from, to
  std::vector<pollfd> polled(hosts_.size());
  std::vector<char> buffer(65536);
  while (!stopping_) {
    // What is due arrives; a cut on the way loses it.
    std::int64_t next = now_ns() + longest_sleep_ns;
    for (auto& [way, packets] : ways) {
      for (; !packets.empty() && packets.front().due_ns <= now_ns(); packets.pop_front()) {
        const std::vector<char>& bytes = packets.front().bytes;
        const Host &from = hosts_[way.first], &to = hosts_[way.second];
        const bool is_open = from.side == to.side && !from.closed[way.second];
        const bool arrives =
            is_open && ::write(to.wire, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
        ++(arrives ? passed_ : lost_);
      }
      if (!packets.empty()) next = std::min(next, packets.front().due_ns);
    }
    // An interface that is down would wake the carrier for ever.
    for (std::size_t k = 0; k < hosts_.size(); ++k) polled[k] = {hosts_[k].is_up ? hosts_[k].wire : -1, POLLIN, 0};
    const std::int64_t sleep_ns = std::max<std::int64_t>(0, next - now_ns());
    const timespec sleep{0, static_cast<long>(sleep_ns)};
    if (::ppoll(polled.data(), polled.size(), &sleep, nullptr) <= 0) continue;
    for (std::size_t from = 0; from < hosts_.size(); ++from) {
      if (!(polled[from].revents & POLLIN)) continue;
      for (ssize_t size = 0; (size = ::read(hosts_[from].wire, buffer.data(), buffer.size())) > 0;) {
        std::uint32_t address = 0;
        if (size < 20 || (buffer[0] >> 4) != 4) continue;  // not of IPv4: neighbour discovery of IPv6
        std::memcpy(&address, buffer.data() + 16, sizeof address);
        const std::size_t to = ntohl(address) - network - 1;
        if (to >= hosts_.size()) continue;
        std::deque<Packet>& way = ways[{from, to}];
        if (way.size() >= longest_queue) {
          ++lost_;
          continue;
        }
        const auto jitter = static_cast<std::int64_t>((2 * random.unit() - 1) * static_cast<double>(jitter_ns_.load()));
        const std::int64_t due = now_ns() + std::max<std::int64_t>(0, delay_ns_ + jitter);
        way.push_back({way.empty() ? due : std::max(due, way.back().due_ns), {buffer.data(), buffer.data() + size}});
      }
    }
  }
}

}  // namespace lichthof::testing
