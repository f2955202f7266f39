#include "actors/codec.hpp"

#include <string>

#include "actors/wire_codec.hpp"

namespace lichthof::actors {

namespace {

// No message of a sound peer comes near these.
constexpr std::uint32_t max_corners = 1u << 12, max_patches = 1u << 8, max_places = 1u << 12,
                        max_bitmap_bytes = 1u << 20;
constexpr std::uint32_t max_pixels = max_message_bytes / 12, max_columns = 1u << 16;

}  // namespace

template <>
inline constexpr std::size_t least_bytes<ShotPatch> = 71;

// ---- The fields, once for both directions -----------------------------------------------------------------------------
// A structure is taken apart by a structured binding: a field that is added to it and forgotten here does not compile.

template <class Codec>
static void fields(Codec& c, Field<Codec, Vec2> v) {
  c(v.x, v.y);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Vec3> v) {
  c(v.x, v.y, v.z);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Rgbf> v) {
  c(v.x, v.y, v.z);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, ShotId> id) {
  auto& [cell, sequence] = id;
  c(cell, sequence);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, Plane> plane) {
  auto& [origin, u, v, normal] = plane;
  c(origin, u, v, normal);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, ColumnJob> job) {
  auto& [first, last] = job;
  c(first, last);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, ShotPatch> patch) {
  auto& [corners, branch, columns, rows, lo, hi, delta, area, openness, reflected, emitted] = patch;
  c(branch, columns, rows, lo, hi, reflected, emitted);
  c.list(corners, max_corners);
  c.list(delta, max_places);
  c.list(area, max_places);
  c.list(openness, max_places);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, Shot> shot) {
  auto& [id, version, group, plane, corners, centre, radius, area, patches] = shot;
  c(id, version, group, plane, centre, radius, area);
  c.list(corners, max_corners);
  c.list(patches, max_patches);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, HemicubeMessage> message) {
  auto& [shot, from, closed, bitmap] = message;
  c(from, closed);
  c.list(bitmap, max_bitmap_bytes);
  if constexpr (Codec::reads) {
    auto copy = std::make_shared<Shot>();
    c(*copy);
    shot = std::move(copy);
  } else {
    MUST(shot);
    c(*shot);
  }
}

template <class Codec>
static void fields(Codec& c, Field<Codec, StartRadiosity> message) {
  auto& [epoch, threshold] = message;
  c(epoch, threshold);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, CellReady> message) {
  auto& [cell, power] = message;
  c(cell, power);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, CellReport> report) {
  auto& [cell, epoch, wave, idle, sent, processed, shots, strongest, unshot, emitted] = report;
  c(cell, epoch, wave, idle, sent, processed, shots, strongest, unshot, emitted);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, PollCell> message) {
  auto& [epoch, wave] = message;
  c(epoch, wave);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, StopRadiosity> message) {
  auto& [epoch] = message;
  c(epoch);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, SetEmission> change) {
  auto& [material, radiance] = change;
  c(material, radiance);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, SetReflectance> change) {
  auto& [material, reflectance] = change;
  c(material, reflectance);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, GeometryChange> message) {
  auto& [version, change] = message;
  static_assert(std::variant_size_v<decltype(GeometryChange::change)> == 2);
  auto kind = static_cast<std::uint8_t>(change.index());
  c(version, kind);
  if constexpr (Codec::reads) {
    if (kind > 1) return c.refuse();
    if (kind == 0) change = SetEmission{};
    if (kind == 1) change = SetReflectance{};
  }
  std::visit([&](auto& one) { c(one); }, change);
}

template <class Codec>
static void fields(Codec& c, Field<Codec, JobRequest> message) {
  auto& [worker] = message;
  c(worker);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, JobAssignment> message) {
  auto& [job, no_more] = message;
  c(job, no_more);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, ColumnResult> result) {
  auto& [worker, job, pixels, rays, seconds] = result;
  c(worker, job, seconds);
  c.list(rays, max_columns);
  c.list(pixels, max_pixels);
}
template <class Codec>
static void fields(Codec& c, Field<Codec, WorkerLost> message) {
  auto& [worker] = message;
  c(worker);
}

// ---- Messages ---------------------------------------------------------------------------------------------------------

namespace {

/// Reads a message of the kind with this number. @returns false when there is no such kind
template <std::size_t K = 0>
bool read_kind(std::size_t kind, WireReader& reader, Message& message) {
  if constexpr (K == std::variant_size_v<Message>) {
    return false;
  } else {
    if (kind != K) return read_kind<K + 1>(kind, reader, message);
    reader(message.emplace<K>());
    return true;
  }
}

Error refused(std::string what) {
  return {ErrorCode::bad_input, "message", std::move(what) + "; it is damaged or from another version of the program"};
}

}  // namespace

Bytes encode(const Message& message) {
  Bytes bytes;
  if (const auto* result = std::get_if<ColumnResult>(&message))
    bytes.reserve(64 + 12 * result->pixels.size() + 8 * result->rays.size());
  if (const auto* light = std::get_if<HemicubeMessage>(&message)) bytes.reserve(2048 + light->bitmap.size());
  bytes.push_back(wire_version);
  bytes.push_back(static_cast<std::uint8_t>(message.index()));
  WireWriter writer(bytes);
  std::visit([&](const auto& one) { writer(one); }, message);
  return bytes;
}

Expected<Message> decode(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2) return refused("shorter than its header");
  if (bytes[0] != wire_version)
    return refused("wire form " + std::to_string(bytes[0]) + " instead of " + std::to_string(wire_version));
  Message message;
  WireReader reader(bytes.subspan(2));
  if (!read_kind(bytes[1], reader, message)) return refused("unknown kind " + std::to_string(bytes[1]));
  if (reader.refused()) return refused("a field is cut off or out of bounds");
  if (!reader.at_end()) return refused("longer than its fields");
  return message;
}

}  // namespace lichthof::actors
