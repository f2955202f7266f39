/// When a message arrives: latency + bytes / bandwidth + a seeded random delay. First in, first out per pair of machines,
/// as TCP keeps it; between pairs the random delay reorders freely.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "core/base/random.hpp"
#include "core/protocol/effects.hpp"

namespace lichthof::sim {

struct NetworkOptions {
  Duration latency{50'000};         ///< between nodes; 50 µs: a switched gigabit network
  Duration local_latency{2'000};    ///< between machines of one node
  double bytes_per_second = 117e6;  ///< of a node's outgoing link; messages leave it one after the other
  Duration jitter{0};               ///< each message is delayed by up to this much more, uniformly
};

class NetworkModel {
 public:
  NetworkModel(const NetworkOptions& options, std::uint64_t seed) : options_(options), random_(seed) {}

  struct Trip {
    Address from, to;
    NodeId from_node, to_node;
  };
  /// Arrival of a message of `bytes` that leaves at `departure`. Calls must come in order of departure.
  Instant arrival(const Trip& trip, std::size_t bytes, Instant departure);

 private:
  NetworkOptions options_;
  Random random_;
  std::map<std::pair<Address, Address>, Instant> last_arrival_;
  std::map<NodeId, Instant> link_free_;
};

/// Size of a message on the wire (bytes): payload plus a frame of 32.
std::size_t wire_bytes(const Message& message);

}  // namespace lichthof::sim
