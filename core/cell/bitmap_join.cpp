#include "core/cell/bitmap_join.hpp"

#include <cmath>

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"
#include "core/cell/plausible.hpp"

namespace lichthof {

namespace {
constexpr std::uint64_t page_bits = 512;

double rank_of(const Shot& shot) {
  const Rgb power = shot.power();
  return std::abs(power.x) + std::abs(power.y) + std::abs(power.z);
}
}  // namespace

BitmapJoin::Filed BitmapJoin::file(const CellGrid& grid, const HemicubeMessage& message) {
  MUST(!complete_);
  // Nothing of the message is believed before all of it has been checked.
  fault_ = message.shot ? fault_of(*message.shot, grid) : ShotFault{};
  if (!message.shot || fault_.what != nullptr || message.from.value >= grid.cell_count()) return Filed::refused;
  const ShotId id = message.shot->id;
  const double power_w = rank_of(*message.shot);
  if (id.cell == cell_ || is_done(id) || !plausible_power(power_w)) return Filed::refused;
  const CellList expected = predecessors(grid, pose_of(grid, *message.shot), cell_);
  if (!expected.contains(message.from)) return Filed::refused;
  const auto found = waiting_.find(id);
  if (found != waiting_.end() &&
      (found->second.from.contains(message.from) || !same_shot(*found->second.joined.shot, *message.shot)))
    return Filed::refused;
  HemicubeBitmap bitmap;
  if (!message.closed) {
    Expected<HemicubeBitmap> read = unpacked(message.bitmap);
    if (!read || read->resolution() != resolution_) return Filed::refused;
    bitmap = std::move(*read);
  }

  const auto place = found != waiting_.end() ? found : waiting_.emplace(id, Waiting{}).first;
  Waiting& waiting = place->second;
  ExternalShot& joined = waiting.joined;
  if (!joined.shot) {
    joined.shot = message.shot;
    joined.power_w = power_w;
    waiting.expected = expected;
  }
  waiting.from.push_back(message.from);
  ++joined.parts;
  joined.closed = joined.closed || message.closed;
  if (joined.closed)
    joined.bitmap = HemicubeBitmap();
  else if (joined.bitmap.resolution() == 0)
    joined.bitmap = std::move(bitmap);
  else
    joined.bitmap.merge(bitmap);
  if (joined.parts < waiting.expected.size()) return Filed::waiting;

  complete_ = std::move(joined);
  waiting_.erase(place);
  mark_done(id);
  return Filed::complete;
}

ExternalShot BitmapJoin::take() {
  MUST(complete_);
  ExternalShot shot = std::move(*complete_);
  complete_.reset();
  return shot;
}

std::uint64_t BitmapJoin::waiting_parts() const {
  std::uint64_t parts = 0;
  for (const auto& [id, waiting] : waiting_) parts += waiting.joined.parts;
  return parts;
}

bool BitmapJoin::is_done(ShotId id) const {
  const auto page = done_.find({id.cell, id.sequence / page_bits});
  if (page == done_.end()) return false;
  const std::uint64_t bit = id.sequence % page_bits;
  return (page->second[bit / 64] >> (bit % 64)) & 1;
}

void BitmapJoin::mark_done(ShotId id) {
  const std::uint64_t bit = id.sequence % page_bits;
  done_[{id.cell, id.sequence / page_bits}][bit / 64] |= 1ull << (bit % 64);
}

std::size_t ExternalShot::memory_bytes() const {
  // The copy of a shot is about as large in memory as on the wire.
  return sizeof(ExternalShot) + pixel_count(bitmap.resolution()) / 8 + (shot ? shot->wire_bytes() : 0);
}

std::size_t BitmapJoin::memory_bytes() const {
  std::size_t bytes = done_.size() * (sizeof(decltype(done_)::value_type) + tree_node_bytes);
  for (const auto& [id, waiting] : waiting_) bytes += sizeof(Waiting) + tree_node_bytes + waiting.joined.memory_bytes();
  return bytes;
}

}  // namespace lichthof
