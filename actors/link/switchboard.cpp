#include "actors/link/switchboard.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;

constexpr auto tick_interval = 100ms;
/// A peer gets this long to read our last words before the descriptor is closed.
constexpr auto shortest_farewell = 100ms;
/// Ended connections that are still looked after; under a flood the oldest are cut off.
constexpr std::size_t max_leaving = 256;

double seconds(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

std::string in_words(std::chrono::milliseconds limit) {
  return fmt::format("{:g} s", static_cast<double>(limit.count()) / 1000);
}

}  // namespace

Switchboard::Switchboard(caf::io::broker& broker, const LinkSetup& setup) : broker_(broker), setup_(setup) {}

Switchboard::~Switchboard() {
  // An actor system waits for its sockets without limit: nothing may be left under way.
  for (const Leaving& leaving : leaving_) leaving.scribe->abort();
  for (const auto& [id, c] : connections_) c->scribe->abort();
}

// ---- Requests ---------------------------------------------------------------------------------------------------------

void Switchboard::listen(Socket socket, std::uint16_t port) {
  if (stopping_) return;
  if (own_port_ == 0) own_port_ = port;
  auto& multiplexer = static_cast<caf::io::network::default_multiplexer&>(broker_.backend());
  auto doorman = caf::make_counted<Doorman>(multiplexer, ++last_id_, std::move(socket));
  doormen_.push_back(doorman->hdl());
  broker_.add_doorman(std::move(doorman));
}

void Switchboard::dial(const Dial& dial) {
  if (stopping_) return;
  // The thread may outlive the actor system while it waits for a name: it must not keep the actor.
  dialler_.dial(dial.host, dial.port, options_.dial_limit, [dial, self = broker_.address()](Expected<Socket> result) {
    const auto actor = caf::actor_cast<caf::actor>(self);
    if (!actor) return;
    if (result)
      caf::anon_send(actor, Dialled{dial, std::make_shared<Socket>(std::move(*result)), {}});
    else
      caf::anon_send(actor, Dialled{dial, nullptr, result.error().message});
  });
}

void Switchboard::close(const Close& close) {
  if (const auto c = connection(static_cast<std::int64_t>(close.peer.value)); c && c->stage == Stage::up)
    end(c, close.reason, Farewell::control_and_reason);
}

void Switchboard::stop() {
  if (std::exchange(stopping_, true)) return;
  for (const auto& doorman : doormen_) broker_.close(doorman);
  while (!connections_.empty()) {
    const ConnectionPointer c = connections_.begin()->second;
    end(c, options_.own.name + " stops", Farewell::control_and_reason);
  }
}

// ---- Connections begin and end ----------------------------------------------------------------------------------------

Switchboard::ConnectionPointer Switchboard::connection(std::int64_t id) const {
  const auto found = connections_.find(id);
  return found == connections_.end() ? nullptr : found->second;
}

void Switchboard::open(Socket socket, bool is_dialled, const std::string& host, std::uint16_t port) {
  auto c = std::make_shared<Connection>();
  c->id = ++last_id_;
  c->dialled = is_dialled;
  c->host = host;
  c->port = port;
  c->opened = c->last_heard = c->last_sent = Clock::now();
  std::unique_ptr<TlsSession> session;
  if (setup_.tls) session = std::make_unique<TlsSession>(setup_.tls, socket.fd(), is_dialled);
  auto& multiplexer = static_cast<caf::io::network::default_multiplexer&>(broker_.backend());
  c->scribe = caf::make_counted<Scribe>(multiplexer, c->id, std::move(socket), std::move(session));
  broker_.add_scribe(c->scribe);
  c->scribe->ack_writes(true);
  c->scribe->configure_read(caf::io::receive_policy::at_most(max_greeting_bytes));
  connections_.emplace(c->id, c);
  if (is_dialled && setup_.tls) c->scribe->begin();
  if (!setup_.tls) secured(c->id);
}

void Switchboard::accepted(Socket socket) {
  if (stopping_) return;
  ++setup_.monitor->accepted;
  // The oldest of the silent ones makes room: whoever means it has greeted long ago.
  if (strangers_.size() >= options_.max_strangers)
    end(connection(*strangers_.begin()), "too many at once who have not greeted", Farewell::none);
  const std::string host = remote_host(socket.fd());
  strangers_.insert(last_id_ + 1);
  setup_.monitor->strangers = strangers_.size();
  open(std::move(socket), false, host, 0);
}

void Switchboard::dialled(const Dialled& answer) {
  if (stopping_) return;
  if (answer.socket) return open(std::move(*answer.socket), true, answer.dial.host, answer.dial.port);
  setup_.monitor->refuse(endpoint(answer.dial.host, answer.dial.port) + ": " + answer.reason);
  broker_.send(setup_.owner, DialFailed{answer.dial.host, answer.dial.port, answer.reason, false});
}

void Switchboard::secured(std::int64_t id) {
  const ConnectionPointer c = connection(id);
  if (!c || c->stage != Stage::securing) return;
  c->stage = Stage::greeting;
  if (c->dialled) greet(c);
}

void Switchboard::closed(std::int64_t id) {
  const ConnectionPointer c = connection(id);
  if (!c) return;
  const TlsSession* session = c->scribe->session();
  std::string reason = session ? session->failure() : "";
  if (reason.empty() && c->stage == Stage::up) reason = "connection lost";
  if (reason.empty() && c->stage == Stage::securing)
    reason = "closed by the peer during the TLS handshake; does it speak TLS?";
  if (reason.empty()) reason = "closed by the peer before the end of the greeting";
  if (c->dialled && !session && c->stage == Stage::greeting) reason += "; does it expect TLS?";
  end(c, reason, Farewell::none);
}

void Switchboard::end(const ConnectionPointer& c, const std::string& reason, Farewell farewell) {
  const Stage was = std::exchange(c->stage, Stage::over);
  if (was == Stage::over) return;
  if (farewell != Farewell::none && was != Stage::securing) {
    std::vector<char>& out = c->scribe->wr_buf();
    if (farewell == Farewell::control_and_reason)
      c->outbox.move_last_to(out);
    else
      c->outbox.finish_frame_to(out);
    const Bytes goodbye = goodbye_frame(reason);
    out.insert(out.end(), goodbye.begin(), goodbye.end());
    c->scribe->flush();
  }
  c->scribe->finish();
  leaving_.push_back({c->scribe, Clock::now()});
  if (leaving_.size() > max_leaving) {
    leaving_.front().scribe->abort();
    leaving_.pop_front();
  }
  connections_.erase(c->id);
  strangers_.erase(c->id);
  setup_.monitor->strangers = strangers_.size();
  tell_end(*c, was, reason);
}

void Switchboard::tell_end(const Connection& c, Stage was, const std::string& reason) {
  if (was == Stage::up) {
    --up_;
    setup_.monitor->remove(c.counters->peer);
    spdlog::info("{} {} ({}) is down: {}", name_of(c.peer.who.role), c.peer.who.name, c.host, reason);
    if (!stopping_) broker_.send(setup_.owner, LinkDown{c.counters->peer, reason});
  } else if (!stopping_) {
    const std::string line = (c.dialled ? endpoint(c.host, c.port) : c.host) + ": " + reason;
    setup_.monitor->refuse(line);
    if (reason != already_connected) log_refusal(line);
    if (c.dialled) broker_.send(setup_.owner, DialFailed{c.host, c.port, reason, reason == already_connected});
  }
}

void Switchboard::log_refusal(const std::string& line) {
  if (!refusals_.take(seconds(Clock::now()))) {
    ++unlogged_refusals_;
    return;
  }
  const std::size_t more = std::exchange(unlogged_refusals_, 0);
  spdlog::warn("no link with {}{}", line, more > 0 ? fmt::format(" (and {} more like it before)", more) : "");
}

void Switchboard::see_off() {
  const auto now = Clock::now();
  std::erase_if(leaving_, [&](const Leaving& leaving) {
    const auto age = now - leaving.since;
    if (leaving.scribe->idle() ? age < shortest_farewell : age < options_.farewell_limit) return false;
    if (leaving.scribe->idle())
      leaving.scribe->drain();
    else
      leaving.scribe->abort();
    return true;
  });
}

// ---- Time -------------------------------------------------------------------------------------------------------------

void Switchboard::tick() {
  const auto now = Clock::now();
  // When this process itself was stopped for a while, what peers said meanwhile has not been read yet: no silence of theirs.
  const auto absence = now - std::exchange(last_tick_, now);
  const bool was_absent = absence > options_.silence_limit / 2;
  end_revoked();
  std::vector<ConnectionPointer> all;
  for (const auto& [id, c] : connections_) all.push_back(c);
  for (const ConnectionPointer& c : all) {
    if (was_absent) {
      c->last_heard += absence;
      c->opened += absence;
    }
    if (c->stage != Stage::over) look_after(c, now);
  }
  see_off();
  if (stopping_ && leaving_.empty()) return broker_.quit();
  broker_.delayed_send(&broker_, tick_interval, Tick{});
}

/// Who was let in before his certificate was taken back.
void Switchboard::end_revoked() {
  if (!setup_.tls) return;
  const std::uint64_t generation = setup_.tls->revocations().generation();
  if (std::exchange(revocations_seen_, generation) == generation) return;
  std::vector<ConnectionPointer> revoked;
  for (const auto& [id, c] : connections_)
    if (const TlsSession* session = c->scribe->session(); session && session->secured() && session->is_revoked())
      revoked.push_back(c);
  for (const ConnectionPointer& c : revoked) end(c, "its certificate has been revoked", Farewell::reason);
}

void Switchboard::look_after(const ConnectionPointer& c, Clock::time_point now) {
  if (c->stage != Stage::up) {
    if (now - c->opened < options_.greeting_limit) return;
    const std::string what = c->stage == Stage::securing ? "no TLS handshake within " : "no greeting within ";
    return end(c, what + in_words(options_.greeting_limit), Farewell::reason);
  }
  if (now - c->last_heard >= options_.silence_limit)
    return end(c, "silent for " + in_words(options_.silence_limit), Farewell::reason);
  if (end_if_slow(c)) return;
  // Also when we hear from the peer: it waits for a word as we do.
  if (now - c->last_sent < options_.ping_interval) return;
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(now.time_since_epoch()).count();
  push_own(*c, number_frame(FrameKind::ping, static_cast<std::uint64_t>(us)));
}

}  // namespace lichthof::actors
