/// Hosts of their own on one wire: each is a network namespace with one interface, and the wire is a thread of the test that
/// hands their packets on: later, or not at all. Kernels without netem delay nothing themselves; so every kernel will do.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/base/expected.hpp"

namespace lichthof::testing {

class LabNetwork {
 public:
  static constexpr std::size_t most_hosts = 32;

  /// @pre   at most most_hosts
  /// @error what is not permitted here: namespaces and interfaces need root, or `unshare -Ur`
  static Expected<std::unique_ptr<LabNetwork>> make(std::size_t hosts);
  ~LabNetwork();
  LabNetwork(const LabNetwork&) = delete;

  /// 10.77.0.1 is host 0.
  std::string address(std::size_t host) const;
  /// File of its namespace, for Surroundings::network.
  int file(std::size_t host) const { return hosts_[host].space; }

  /// Every packet takes delay_ms and up to jitter_ms more or less; packets between two hosts stay in order.
  void delay(double delay_ms, double jitter_ms);
  /// Packets pass between hosts of one side only. All begin on side 0.
  void put(std::size_t host, unsigned side) { hosts_[host].side = side; }
  /// Opens or closes the way between two hosts alone.
  void set_open(std::size_t a, std::size_t b, bool is_open) { hosts_[a].closed[b] = hosts_[b].closed[a] = !is_open; }
  /// The interface itself goes down or up, as when its cable is pulled: who sends learns of it at once.
  void set_link(std::size_t host, bool is_up);

  std::uint64_t passed() const { return passed_; }
  std::uint64_t lost() const { return lost_; }

 private:
  struct Host {
    int space = -1, wire = -1, control = -1;
    std::atomic<unsigned> side{0};
    std::atomic<bool> is_up{true};
    std::array<std::atomic<bool>, most_hosts> closed{};
  };

  explicit LabNetwork(std::size_t hosts) : hosts_(hosts) {}
  Status open(std::size_t host);
  void carry();

  std::vector<Host> hosts_;
  std::atomic<std::int64_t> delay_ns_{0}, jitter_ns_{0};
  std::atomic<std::uint64_t> passed_{0}, lost_{0};
  std::atomic<bool> stopping_{false};
  std::thread carrier_;
};

}  // namespace lichthof::testing
