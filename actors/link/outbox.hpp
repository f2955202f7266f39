/// What waits to be sent to one peer, and in which order it goes: control before bulk, bulk only on credit.
///
/// A frame that has begun is finished first, piece by piece, so that little lies in the socket's buffer and a control frame
/// waits for the rest of one frame at most.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "actors/link/frame.hpp"

namespace lichthof::actors {

/// A bulk frame costs its bytes and this, so that empty frames cost something, too.
constexpr std::size_t frame_overhead_bytes = 256;

class Outbox {
 public:
  void push(FrameKind kind, SharedBytes bytes);
  /// A frame of the link's own, header included: goes with control.
  void push_own(Bytes frame);
  /// @param window  credit never grows above it. A frame larger than the window is given back whole all the same: it has
  ///                taken the credit below zero
  void grant(std::uint64_t bytes, std::uint32_t window) {
    const std::int64_t missing = std::max<std::int64_t>(0, std::int64_t{window} - credit_);
    credit_ += static_cast<std::int64_t>(std::min(bytes, static_cast<std::uint64_t>(missing)));
  }

  /// Appends to `out` until it holds `most` bytes or nothing may be sent.
  /// @returns how many frames were finished
  std::size_t move_to(std::vector<char>& out, std::size_t most);
  /// Appends the rest of the frame that has begun and all of control; bulk is dropped.
  void move_last_to(std::vector<char>& out);
  /// Appends only the rest of the frame that has begun.
  void finish_frame_to(std::vector<char>& out);

  std::size_t queued_bytes() const { return queued_bytes_; }
  std::int64_t credit() const { return credit_; }

 private:
  struct Item {
    Bytes header;
    SharedBytes bytes;  ///< may be null: a frame of the link's own is all header
    std::size_t size() const { return header.size() + (bytes ? bytes->size() : 0); }
  };
  bool next_item();

  std::deque<Item> control_, bulk_;
  Item current_;
  std::size_t current_at_ = 0;
  bool has_current_ = false;
  std::size_t queued_bytes_ = 0;
  std::int64_t credit_ = 0;  ///< below zero after a frame that was larger than the rest
};

/// So many frames at once, so many per second.
class TokenBucket {
 public:
  TokenBucket(double per_second, double burst) : per_second_(per_second), burst_(burst), tokens_(burst) {}
  /// @param now_s  seconds on any clock that only goes forward
  bool take(double now_s);

 private:
  double per_second_, burst_, tokens_;
  double last_s_ = 0;
};

}  // namespace lichthof::actors
