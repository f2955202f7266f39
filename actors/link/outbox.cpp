#include "actors/link/outbox.hpp"

#include <algorithm>
#include <limits>

namespace lichthof::actors {

void Outbox::push(FrameKind kind, SharedBytes bytes) {
  Item item;
  put_header(item.header, bytes->size(), kind);
  item.bytes = std::move(bytes);
  queued_bytes_ += item.size();
  (kind == FrameKind::bulk ? bulk_ : control_).push_back(std::move(item));
}

void Outbox::push_own(Bytes frame) {
  queued_bytes_ += frame.size();
  control_.push_back({std::move(frame), nullptr});
}

bool Outbox::next_item() {
  const bool from_bulk = control_.empty();
  if (from_bulk && (bulk_.empty() || credit_ <= 0)) return false;
  std::deque<Item>& queue = from_bulk ? bulk_ : control_;
  current_ = std::move(queue.front());
  queue.pop_front();
  if (from_bulk) credit_ -= static_cast<std::int64_t>(current_.bytes->size() + frame_overhead_bytes);
  current_at_ = 0;
  has_current_ = true;
  return true;
}

std::size_t Outbox::move_to(std::vector<char>& out, std::size_t most) {
  std::size_t finished = 0;
  while (out.size() < most && (has_current_ || next_item())) {
    const std::size_t header = current_.header.size();
    std::size_t room = most - out.size();
    if (current_at_ < header) {
      // A header is never cut: it is shorter than what matters.
      out.insert(out.end(), current_.header.begin(), current_.header.end());
      current_at_ = header;
      room -= std::min(room, header);
    }
    const std::size_t at = current_at_ - header, left = current_.size() - current_at_, piece = std::min(left, room);
    if (piece > 0) {
      const auto* from = reinterpret_cast<const char*>(current_.bytes->data()) + at;
      out.insert(out.end(), from, from + piece);
      current_at_ += piece;
    }
    if (current_at_ < current_.size()) break;
    queued_bytes_ -= current_.size();
    current_ = {};
    has_current_ = false;
    ++finished;
  }
  return finished;
}

void Outbox::finish_frame_to(std::vector<char>& out) {
  if (!has_current_) return;
  std::deque<Item> control, bulk;
  control.swap(control_);
  bulk.swap(bulk_);
  move_to(out, std::numeric_limits<std::size_t>::max());
  queued_bytes_ = 0;
}

void Outbox::move_last_to(std::vector<char>& out) {
  bulk_.clear();
  move_to(out, std::numeric_limits<std::size_t>::max());
  queued_bytes_ = 0;
}

bool TokenBucket::take(double now_s) {
  tokens_ = std::min(burst_, tokens_ + (now_s - last_s_) * per_second_);
  last_s_ = now_s;
  if (tokens_ < 1) return false;
  tokens_ -= 1;
  return true;
}

}  // namespace lichthof::actors
