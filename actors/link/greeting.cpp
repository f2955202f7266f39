// Who is at the other end, may he be there, and is it the only connection to him?
#include <spdlog/spdlog.h>

#include <algorithm>

#include "actors/link/switchboard.hpp"

namespace lichthof::actors {

namespace {

constexpr std::size_t read_bytes = 64u << 10;
/// No sound peer offers more.
constexpr std::uint32_t max_window = 1u << 30;

}  // namespace

void Switchboard::greet(const ConnectionPointer& c) {
  write_now(*c, hello_frame(
                    {link_protocol, setup_.boot_id, own_port_, options_.bulk_window, options_.version, options_.own}));
}

void Switchboard::greeted(const ConnectionPointer& c, const Frame& frame) {
  if (frame.kind == FrameKind::goodbye) {
    const std::string reason = reason_in(frame);
    return end(c, reason == already_connected ? reason : "refused by the peer: " + reason, Farewell::none);
  }
  if (c->stage == Stage::confirming && frame.kind == FrameKind::ready) return confirmed(c);
  if (c->stage != Stage::greeting || frame.kind != FrameKind::hello)
    return end(c, "a greeting out of turn", Farewell::reason);
  Expected<Hello> hello = hello_in(frame, options_.version);
  if (!hello) return end(c, hello.error().message, Farewell::reason);
  c->peer = std::move(*hello);
  c->peer.bulk_window = std::min(c->peer.bulk_window, max_window);
  if (const TlsSession* session = c->scribe->session()) c->peer.who = session->peer();
  if (!is_welcome(c)) return;
  if (c->dialled) {
    if (!decide_by_dialler(c)) return;
    Bytes ready;
    put_header(ready, 0, FrameKind::ready);
    write_now(*c, ready);
    bring_up(c);
  } else {
    greet(c);
    c->stage = Stage::confirming;
  }
}

bool Switchboard::is_welcome(const ConnectionPointer& c) {
  const auto& roles = c->dialled ? options_.dialled_roles : options_.accepted_roles;
  if (std::find(roles.begin(), roles.end(), c->peer.who.role) == roles.end())
    return end(c, "role " + name_of(c->peer.who.role) + " of " + c->peer.who.name + " is not allowed here",
               Farewell::reason),
           false;
  if (c->peer.boot_id == setup_.boot_id) return end(c, "this is the same process", Farewell::reason), false;
  if (up_ >= options_.max_peers) return end(c, "too many peers", Farewell::reason), false;
  if (c->dialled) return true;
  const auto ours = other(*c, [](const Connection& o) { return o.stage == Stage::up && o.dialled; });
  if (!ours) return true;
  // Should the peer not know of it any more, the answer of its machine ends it at once.
  push_own(*ours, number_frame(FrameKind::ping, 0));
  return end(c, already_connected, Farewell::reason), false;
}

Switchboard::ConnectionPointer Switchboard::other(const Connection& c,
                                                  const std::function<bool(const Connection&)>& condition) const {
  // The name as well: nobody speaks for somebody else, whatever number he greets with.
  for (const auto& [id, o] : connections_)
    if (id != c.id && o->peer.boot_id == c.peer.boot_id && o->peer.who.name == c.peer.who.name && condition(*o))
      return o;
  return nullptr;
}

bool Switchboard::decide_by_dialler(const ConnectionPointer& c) {
  if (other(*c, [](const Connection& o) { return o.stage == Stage::up; }))
    return end(c, already_connected, Farewell::reason), false;
  const auto theirs = other(*c, [](const Connection& o) { return o.stage == Stage::confirming; });
  if (!theirs) return true;
  const bool ours_stays = setup_.boot_id < c->peer.boot_id;
  end(ours_stays ? theirs : c, already_connected, Farewell::reason);
  return ours_stays;
}

void Switchboard::confirmed(const ConnectionPointer& c) {
  // Its dialler has no other connection any more: one that is still up here is a remainder.
  if (const auto older = other(*c, [](const Connection& o) { return o.stage == Stage::up; }))
    end(older, "replaced by a newer connection", Farewell::reason);
  bring_up(c);
}

void Switchboard::bring_up(const ConnectionPointer& c) {
  c->stage = Stage::up;
  ++up_;
  strangers_.erase(c->id);
  setup_.monitor->strangers = strangers_.size();
  c->reader.admit(options_.max_frame_bytes);
  c->scribe->configure_read(caf::io::receive_policy::at_most(read_bytes));
  c->outbox.grant(c->peer.bulk_window, c->peer.bulk_window);
  c->frames = TokenBucket(options_.frames_per_second, options_.frames_at_once);
  c->counters = std::make_shared<PeerCounters>();
  c->counters->peer = PeerId{static_cast<std::uint64_t>(c->id)};
  c->counters->who = c->peer.who;
  c->counters->host = c->host;
  setup_.monitor->add(c->counters);
  if (c->peer.version != options_.version)
    spdlog::warn("{} {} ({}) runs lichthof {}, this is {}", name_of(c->peer.who.role), c->peer.who.name, c->host,
                 c->peer.version, options_.version);
  spdlog::info("{} {} ({}) is up", name_of(c->peer.who.role), c->peer.who.name, c->host);
  broker_.send(setup_.owner, LinkUp{c->counters->peer, c->peer.who, c->peer.boot_id, c->peer.version, c->host,
                                    c->peer.port, c->dialled});
}

}  // namespace lichthof::actors
