#include "sim/network_model.hpp"

#include <algorithm>

namespace lichthof::sim {

Instant NetworkModel::arrival(const Trip& trip, std::size_t bytes, Instant departure) {
  Instant at = departure;
  if (trip.from_node == trip.to_node) {
    at = at + options_.local_latency;
  } else {
    Instant& link_free = link_free_[trip.from_node];
    link_free = std::max(link_free, departure) +
                Duration{static_cast<std::int64_t>(1e9 * static_cast<double>(bytes) / options_.bytes_per_second)};
    at = link_free + options_.latency;
  }
  at = at + Duration{static_cast<std::int64_t>(random_.unit() * static_cast<double>(options_.jitter.ns))};
  Instant& last = last_arrival_[{trip.from, trip.to}];
  last = std::max(last, at);
  return last;
}

std::size_t wire_bytes(const Message& message) {
  constexpr std::size_t frame = 32;
  if (const auto* light = std::get_if<HemicubeMessage>(&message))
    return frame + light->shot->wire_bytes() + light->bitmap.size();
  if (const auto* columns = std::get_if<ColumnResult>(&message))
    return frame + 32 + 12 * columns->pixels.size() + 8 * columns->rays.size();
  if (std::holds_alternative<CellReport>(message)) return frame + 112;
  return frame + 32;
}

}  // namespace lichthof::sim
