// Frames between two ends that know each other.
#include <algorithm>

#include "actors/link/switchboard.hpp"

namespace lichthof::actors {

namespace {

/// The same bytes; they are counted as held until the last owner lets go of them, on whatever thread.
SharedBytes counted(SharedBytes bytes, const std::shared_ptr<PeerCounters>& counters) {
  counters->held_bytes += bytes->size();
  const Bytes* raw = bytes.get();
  return SharedBytes(raw,
                     [bytes = std::move(bytes), counters](const Bytes*) { counters->held_bytes -= bytes->size(); });
}

}  // namespace

void Switchboard::arrived(std::int64_t id, std::span<const std::uint8_t> bytes) {
  const ConnectionPointer c = connection(id);
  if (!c) return;
  secured(id);  // the first bytes may overtake the message that says so
  c->last_heard = Clock::now();
  if (c->counters) c->counters->bytes_in += bytes.size();
  while (c->stage != Stage::over) {
    Expected<std::optional<Frame>> frame = c->reader.next(bytes);
    if (!frame) return end(c, frame.error().message, Farewell::reason);
    if (!*frame) return;
    if (c->stage == Stage::up)
      take(c, **frame);
    else
      greeted(c, **frame);
  }
}

void Switchboard::take(const ConnectionPointer& c, const Frame& frame) {
  ++c->counters->frames_in;
  const PeerId peer = c->counters->peer;
  if (frame.kind == FrameKind::bulk) {
    if (c->held_credit >= options_.bulk_window) return end(c, "sends more than its credit", Farewell::reason);
    c->held_credit += frame.bytes->size() + frame_overhead_bytes;
    return broker_.send(setup_.owner, FrameArrived{peer, true, frame.bytes});
  }
  const double now_s = std::chrono::duration<double>(c->last_heard.time_since_epoch()).count();
  if (!c->frames.take(now_s)) return end(c, "sends too many frames", Farewell::reason);
  const auto number = number_in(frame);
  switch (frame.kind) {
    case FrameKind::control:
      broker_.send(setup_.owner, FrameArrived{peer, false, counted(frame.bytes, c->counters)});
      if (c->counters->held_bytes <= options_.max_held_bytes) return;
      return end(c, "sends faster than it is listened to", Farewell::reason);
    case FrameKind::goodbye:
      return end(c, "left: " + reason_in(frame), Farewell::none);
    case FrameKind::credit:
      if (!number) break;
      c->outbox.grant(*number, c->peer.bulk_window);
      return pump(*c);
    case FrameKind::ping:
      if (!number) break;
      return push_own(*c, number_frame(FrameKind::pong, *number));
    case FrameKind::pong: {
      if (!number) break;
      const auto us = std::chrono::duration_cast<std::chrono::microseconds>(c->last_heard.time_since_epoch()).count();
      if (*number > 0 && *number < static_cast<std::uint64_t>(us))
        c->counters->round_trip_us = static_cast<std::uint64_t>(us) - *number;
      return;
    }
    default:
      return end(c, "a second greeting", Farewell::reason);
  }
  end(c, "a damaged frame", Farewell::reason);
}

void Switchboard::send(const Send& send) {
  const ConnectionPointer c = connection(static_cast<std::int64_t>(send.peer.value));
  if (!c || c->stage != Stage::up) return;
  c->outbox.push(send.kind, send.bytes);
  pump(*c);
  end_if_slow(c);
}

/// @returns whether it was
bool Switchboard::end_if_slow(const ConnectionPointer& c) {
  const std::size_t waiting = c->outbox.queued_bytes() + c->unsent_bytes;
  if (waiting <= options_.max_queued_bytes) return false;
  end(c, "too slow: " + std::to_string(waiting >> 20) + " MiB wait for it", Farewell::reason);
  return true;
}

void Switchboard::consumed(const Consumed& consumed) {
  const ConnectionPointer c = connection(static_cast<std::int64_t>(consumed.peer.value));
  if (!c || c->stage != Stage::up) return;
  const std::uint64_t credit = std::min(consumed.credit, c->held_credit);
  c->held_credit -= credit;
  c->unsaid_credit += credit;
  if (c->unsaid_credit < options_.bulk_window / 4) return;
  push_own(*c, number_frame(FrameKind::credit, std::exchange(c->unsaid_credit, 0)));
}

void Switchboard::push_own(Connection& c, Bytes frame) {
  c.outbox.push_own(std::move(frame));
  pump(c);
}

/// What belongs to the greeting goes out before there is a queue.
void Switchboard::write_now(Connection& c, const Bytes& frame) {
  std::vector<char>& out = c.scribe->wr_buf();
  out.insert(out.end(), frame.begin(), frame.end());
  c.unsent_bytes += frame.size();
  c.last_sent = Clock::now();
  c.scribe->flush();
}

void Switchboard::written(std::int64_t id, std::size_t remaining) {
  const ConnectionPointer c = connection(id);
  if (!c) return;
  c->unsent_bytes = remaining;
  if (c->stage == Stage::up) pump(*c);
}

void Switchboard::pump(Connection& c) {
  if (c.unsent_bytes < options_.socket_bytes) {
    std::vector<char>& out = c.scribe->wr_buf();
    const std::size_t before = out.size();
    c.counters->frames_out += c.outbox.move_to(out, before + options_.socket_bytes - c.unsent_bytes);
    const std::size_t moved = out.size() - before;
    if (moved > 0) {
      c.counters->bytes_out += moved;
      c.unsent_bytes += moved;
      c.last_sent = Clock::now();
      c.scribe->flush();
    }
  }
  tell_queue(c);
}

void Switchboard::tell_queue(Connection& c) {
  const std::size_t queued = c.outbox.queued_bytes();
  c.counters->queued_bytes = queued;
  const bool blocked = queued > (c.blocked ? options_.blocked_bytes / 2 : options_.blocked_bytes);
  if (blocked == c.blocked) return;
  c.blocked = blocked;
  if (blocked)
    broker_.send(setup_.owner, LinkBlocked{c.counters->peer});
  else
    broker_.send(setup_.owner, LinkReady{c.counters->peer});
}

}  // namespace lichthof::actors
