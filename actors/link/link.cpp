#include "actors/link/link.hpp"

#include <spdlog/spdlog.h>
#include <sys/random.h>

#include <algorithm>
#include <caf/io/all.hpp>

#include "actors/link/switchboard.hpp"
#include "actors/log.hpp"
#include "core/base/check.hpp"

namespace lichthof::actors {

namespace {

std::uint64_t drawn_boot_id() {
  std::uint64_t id = 0;
  MUST(::getrandom(&id, sizeof id, 0) == sizeof id);
  return id;
}

struct LinkState {
  static inline const char* name = "link";
  std::unique_ptr<Switchboard> board;
};

using LinkActor = caf::stateful_actor<LinkState, caf::io::broker>;

caf::behavior link_actor(LinkActor* self, const std::shared_ptr<LinkSetup>& setup) {
  report_failures(self, "link");
  self->set_down_handler([self](const caf::down_msg&) { self->quit(); });
  self->monitor(setup->owner);
  self->state.board = std::make_unique<Switchboard>(*self, *setup);
  const auto board = self->state.board.get();
  self->send(self, Tick{});
  return {
      [=](const caf::io::new_data_msg& data) {
        board->arrived(data.handle.id(), {reinterpret_cast<const std::uint8_t*>(data.buf.data()), data.buf.size()});
      },
      [=](const caf::io::data_transferred_msg& sent) { board->written(sent.handle.id(), sent.remaining); },
      [=](const caf::io::connection_closed_msg& closed) { board->closed(closed.handle.id()); },
      [=](const Accepted& stranger) { board->accepted(std::move(*stranger.socket)); },
      [=](const Secured& secured) { board->secured(secured.connection); },
      [=](const Dialled& answer) { board->dialled(answer); },
      [=](const Listen& listen) { board->listen(std::move(*listen.socket), listen.port); },
      [=](const Dial& dial) { board->dial(dial); },
      [=](const Send& send) { board->send(send); },
      [=](const Consumed& consumed) { board->consumed(consumed); },
      [=](const Close& close) { board->close(close); },
      [=](const StopLink&) { board->stop(); },
      [=](const Tick&) { board->tick(); },
  };
}

}  // namespace

std::vector<std::shared_ptr<const PeerCounters>> LinkMonitor::peers() const {
  const std::lock_guard lock(mutex_);
  return peers_;
}

std::string LinkMonitor::last_refusal() const {
  const std::lock_guard lock(mutex_);
  return last_refusal_;
}

void LinkMonitor::add(std::shared_ptr<const PeerCounters> peer) {
  const std::lock_guard lock(mutex_);
  peers_.push_back(std::move(peer));
}

void LinkMonitor::remove(PeerId peer) {
  const std::lock_guard lock(mutex_);
  std::erase_if(peers_, [&](const auto& counters) { return counters->peer == peer; });
}

void LinkMonitor::refuse(const std::string& why) {
  const std::lock_guard lock(mutex_);
  last_refusal_ = why;
  ++refused;
}

Expected<Link> Link::start(caf::actor_system& system, const caf::actor& owner, LinkOptions options) {
  MUST(system.has_middleman());
  auto setup = std::make_shared<LinkSetup>();
  if (options.tls) {
    Expected<std::shared_ptr<const TlsContext>> tls = TlsContext::load(*options.tls);
    if (!tls) return tls.error();
    setup->tls = std::move(*tls);
    options.own = setup->tls->own();
  }
  if (!is_name(options.own.name))
    return Error{ErrorCode::bad_input, "name",
                 "a name has 1 to 64 letters, digits and ._-, and begins with no dot or dash"};
  Link link;
  link.own_ = options.own;
  link.boot_id_ = drawn_boot_id();
  link.encrypted_ = options.tls.has_value();
  link.insecure_ = options.insecure;
  link.max_frame_bytes_ = options.max_frame_bytes;
  link.monitor_ = std::make_shared<LinkMonitor>();
  setup->options = std::move(options);
  setup->boot_id = link.boot_id_;
  setup->monitor = link.monitor_;
  setup->owner = owner;
  link.actor_ = system.middleman().spawn_broker(link_actor, setup);
  return link;
}

Expected<std::uint16_t> Link::listen(const std::string& host, std::uint16_t port) const {
  if (!encrypted_ && !is_loopback(host)) {
    if (!insecure_)
      return Error{ErrorCode::bad_input, endpoint(host, port),
                   "without TLS only loopback addresses are listened on; give certificate, key and authority"};
    spdlog::warn("{}: listening without TLS: everybody who reaches this port may take part", endpoint(host, port));
  }
  Expected<Socket> socket = listening_socket(host, port);
  if (!socket) return socket.error();
  const std::uint16_t bound = local_port(*socket);
  caf::anon_send(actor_, Listen{std::make_shared<Socket>(std::move(*socket)), bound});
  return bound;
}

void Link::dial(const std::string& host, std::uint16_t port) const { caf::anon_send(actor_, Dial{host, port}); }

void Link::send(PeerId peer, FrameKind kind, SharedBytes bytes) const {
  MUST(bytes && bytes->size() <= max_frame_bytes_);
  caf::anon_send(actor_, Send{peer, kind, std::move(bytes)});
}

void Link::consumed(PeerId peer, std::size_t bytes, std::size_t frames) const {
  caf::anon_send(actor_, Consumed{peer, bytes + frames * frame_overhead_bytes});
}

void Link::close(PeerId peer, const std::string& reason) const { caf::anon_send(actor_, Close{peer, reason}); }

void Link::stop() const { caf::anon_send(actor_, StopLink{}); }

}  // namespace lichthof::actors
