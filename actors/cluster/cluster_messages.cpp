#include "actors/cluster/cluster_messages.hpp"

#include "actors/codec.hpp"
#include "actors/wire_codec.hpp"

namespace lichthof::actors {

namespace {

constexpr std::uint32_t max_actors = 1u << 14, max_nodes = 1u << 16, max_light = 1u << 28,
                        max_blob = 2 * blob_part_bytes, max_numbers = 1u << 8;

}  // namespace

template <>
inline constexpr std::size_t least_bytes<Peer> = 18;
template <>
inline constexpr std::size_t least_bytes<ActorLoad> = 80;

template <class Codec>
static void fields(Codec& c, Field<Codec, Registration> message) {
  auto& [name, cores, memory, rays] = message;
  c(name, cores, memory, rays);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Welcome> message) {
  auto& [node] = message;
  c(node);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, ActorLoad> load) {
  auto& [name, job, state, busy, mailbox, shots, rays, in, out, memory, unshot] = load;
  c(name, job, state, busy, mailbox, shots, rays, in, out, memory, unshot);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, NodeReport> message) {
  auto& [busy, pace, free, used, at_ns, shots, rays, actors] = message;
  c(busy, pace, free, used, at_ns, shots, rays);
  c.list(actors, max_actors);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Peer> peer) {
  auto& [node, host, port, boot_id] = peer;
  c(node, host, port, boot_id);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, PictureSpec> spec) {
  auto& [method, width, height, samples, gather, camera] = spec;
  c(method, width, height, samples, gather);
  c.list(camera, max_numbers);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, HostShare> message) {
  auto& [job, epoch, pass, solution, cells, peers, picture, first_worker, workers, bytes] = message;
  auto kind = static_cast<std::uint8_t>(pass);
  c(job, epoch, kind, solution, picture, first_worker, workers, bytes);
  c.list(cells, max_nodes);
  c.list(peers, max_nodes);
  if constexpr (Codec::reads) {
    if (kind > 1) return c.refuse();
    pass = static_cast<Pass>(kind);
  }
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Hosted> message) {
  auto& [job, epoch] = message;
  c(job, epoch);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, HostFailed> message) {
  auto& [job, epoch, reason, is_unreachable] = message;
  c(job, epoch, reason, is_unreachable);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, ReleaseShare> message) {
  auto& [job, epoch] = message;
  c(job, epoch);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, RunMessage> message) {
  auto& [job, epoch, to_kind, to, bytes] = message;
  c(job, epoch, to_kind, to);
  c.list(bytes, max_message_bytes);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, CollectCells> message) {
  auto& [job, epoch] = message;
  c(job, epoch);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Rgb> v) {
  c(v.x, v.y, v.z);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, CellPower> power) {
  auto& [unshot, unshot_absolute, emitted, absorbed, shot, received, area] = power;
  c(unshot, unshot_absolute, emitted, absorbed, shot, received, area);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, SolveCounters> counters) {
  auto& [shots, rays, saved, remembered, factors, messages, bytes, bitmaps, bitmaps_raw, skipped, tested, behind, hidden,
         cut] = counters;
  c(shots, rays, saved, remembered, factors, messages, bytes, bitmaps, bitmaps_raw, skipped, tested, behind, hidden, cut);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, CellImage> image) {
  auto& [job, epoch, cell, light, power, counters] = image;
  c(job, epoch, cell, power, counters);
  c.list(light, max_light);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, WantBlob> message) {
  auto& [hash, offset] = message;
  c(hash, offset);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, BlobPart> message) {
  auto& [hash, offset, total, bytes] = message;
  c(hash, offset, total);
  c.list(bytes, max_blob);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Dismissed> message) {
  auto& [reason] = message;
  c(reason);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Leaving> message) {
  auto& [reason] = message;
  c(reason);
}

Address address(const RunMessage& message) {
  switch (message.to_kind) {
    case 0:
      return ToController{};
    case 1:
      return ToBalancer{};
    case 2:
      return CellId{message.to};
    default:
      return WorkerId{message.to};
  }
}

RunMessage run_message(JobId job, Epoch epoch, const Address& to, const Message& message) {
  RunMessage out{job, epoch, static_cast<std::uint8_t>(to.index()), 0, encode(message)};
  if (const auto* cell = std::get_if<CellId>(&to)) out.to = cell->value;
  if (const auto* worker = std::get_if<WorkerId>(&to)) out.to = worker->value;
  return out;
}

namespace {

template <std::size_t K = 0>
bool read_kind(std::size_t kind, WireReader& reader, ClusterMessage& message) {
  if constexpr (K == std::variant_size_v<ClusterMessage>) {
    return false;
  } else {
    if (kind != K) return read_kind<K + 1>(kind, reader, message);
    reader(message.emplace<K>());
    return true;
  }
}

}  // namespace

std::vector<std::uint8_t> encode(const ClusterMessage& message) {
  Bytes bytes{cluster_wire_version, static_cast<std::uint8_t>(message.index())};
  WireWriter writer(bytes);
  std::visit([&](const auto& one) { writer(one); }, message);
  return bytes;
}

Expected<ClusterMessage> decode_cluster(std::span<const std::uint8_t> bytes) {
  const auto refused = [](const char* why) { return Error{ErrorCode::bad_input, "frame", why}; };
  if (bytes.size() < 2 || bytes[0] != cluster_wire_version) return refused("of another version of the program");
  ClusterMessage message;
  WireReader reader(bytes.subspan(2));
  if (!read_kind(bytes[1], reader, message)) return refused("of an unknown kind");
  if (reader.refused() || !reader.at_end()) return refused("with a field cut off, too long or out of bounds");
  return message;
}

}  // namespace lichthof::actors
