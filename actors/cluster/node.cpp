#include "actors/cluster/node.hpp"

#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <numeric>
#include <set>
#include <thread>

#include "actors/cluster/hosted_run.hpp"
#include "actors/codec.hpp"
#include "actors/log.hpp"
#include "actors/system_config.hpp"

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;

using tick_atom = caf::atom_constant<caf::atom("tick")>;
using report_atom = caf::atom_constant<caf::atom("report")>;
using dial_atom = caf::atom_constant<caf::atom("dial")>;

constexpr auto tick = 20ms;  // credit goes back to senders as often
constexpr auto report_every = 1s;
constexpr auto dial_again = 500ms;
constexpr auto load_may_last = 2s;                     // beyond the node's end
constexpr std::uint64_t busy_enough_ns = 200'000'000;  // to tell the pace of actors
constexpr unsigned most_dials = 20;                    // of another node, before its run is given up

/// What a thread that loads a run hands back.
struct Loaded {
  JobId job;
  Epoch epoch;
  std::shared_ptr<HostedRun> run;  ///< empty: see reason
  std::shared_ptr<const Solution> solution;
  std::string reason;
};

/// Bulk that a cell has not processed yet, in the order of arrival.
struct Unpaid {
  PeerId peer;
  std::size_t bytes = 0;
};

/// A run as this node knows it.
struct Share {
  HostShare wanted;
  bool loading = false, started = false;
  std::shared_ptr<HostedRun> run;
  std::map<NodeId, PeerId> reached;  ///< of its partners
  std::map<CellId, std::deque<Unpaid>> unpaid;
  std::map<CellId, std::uint64_t> paid;  ///< hemicube messages
  HostedRun::Worked seen;                ///< when it was last reported
  HostedRun::Worked counted;             ///< of its work, already in the node's counters
};

class NodeState {
 public:
  static constexpr const char* name = "node";

  void begin(caf::event_based_actor* self, const NodeOptions& options, std::shared_ptr<BlobCache> cache,
             std::shared_ptr<std::atomic<unsigned>> loads, bool may_work) {
    self_ = self;
    options_ = options;
    loads_ = std::move(loads);
    cache_ = std::move(cache);
    is_paused_ = !may_work;
    counters().working = may_work;
    if (is_paused_) spdlog::info("the owner is at this machine: waiting until he leaves");
  }
  void use(const Link& link) {
    link_ = link;
    dial_lead();
    self_->delayed_send(self_, tick, tick_atom{});
    self_->delayed_send(self_, report_every, report_atom{});
  }
  void end() {
    to_lead(Leaving{"it is being stopped"});
    drop_shares();
    if (link_) link_->stop();
  }

  // ---- Its owner ----

  void pause() {
    if (std::exchange(is_paused_, true)) return;
    spdlog::info("the owner is at this machine: work goes back to the controller");
    counters().working = false, ++counters().yields;
    leave("its owner is at the machine");
    // The owner's programs need the memory as well.
    last_solution_.reset(), last_solution_hash_.clear();
    ::malloc_trim(0);
  }
  void go_on() {
    if (!std::exchange(is_paused_, false)) return;
    spdlog::info("the owner is away: this machine works");
    counters().working = true;
    dial_lead();
  }

  // ---- The link ----

  void on(const LinkUp& up) {
    if (is_paused_ && up.who.role == Role::controller) return link_->close(up.peer, "its owner is at the machine");
    if (up.who.role == Role::controller && up.dialled && !lead_) {
      lead_ = up.peer;
      spdlog::info("connected to the controller {} at {}:{}", up.who.name, up.host, up.port);
      Registration facts = options_.facts;
      if (facts.name.empty()) facts.name = link_->own().name;
      to_lead(facts);
      joined_shots_ = counters().shots, joined_rays_ = counters().rays;
      counters().connected = true;
      return;
    }
    peers_[up.boot_id] = up.peer;
    for (auto& [key, share] : shares_) start_if_ready(share);
  }

  void on(const LinkDown& down) {
    if (lead_ == down.peer) {
      spdlog::warn("the controller is gone: {}", down.reason);
      counters().connected = false;
      lead_.reset();
      drop_shares();
      wanted_blobs_.clear();
      self_->delayed_send(self_, dial_again, dial_atom{});
      return;
    }
    std::erase_if(peers_, [&](const auto& peer) { return peer.second == down.peer; });
    std::vector<std::pair<JobId, Epoch>> broken;
    for (const auto& [key, share] : shares_)
      for (const auto& [node, peer] : share.reached)
        if (peer == down.peer) broken.push_back({share.wanted.job, share.wanted.epoch});
    for (const auto& [job, epoch] : broken) fail(job, epoch, "another node can not be reached: " + down.reason, true);
  }

  void on(const DialFailed& failed) {
    if (failed.host == options_.lead_host && failed.port == options_.lead_port) {
      if (lead_) return;
      if (!said_unreachable_)
        spdlog::warn("the controller at {}:{} can not be reached: {}", failed.host, failed.port, failed.reason);
      said_unreachable_ = true;
      self_->delayed_send(self_, dial_again, dial_atom{});
      return;
    }
    if (failed.connected) return;
    std::vector<std::pair<JobId, Epoch>> hopeless;
    for (auto& [key, share] : shares_)
      for (const Peer& peer : share.wanted.peers)
        if (peer.host == failed.host && peer.port == failed.port && ++dials_[peer.boot_id] >= most_dials)
          hopeless.push_back({share.wanted.job, share.wanted.epoch});
    for (const auto& [job, epoch] : hopeless)
      fail(job, epoch, failed.host + " can not be reached: " + failed.reason, true);
  }

  void on(const FrameArrived& frame) {
    Expected<ClusterMessage> message = decode_cluster(*frame.bytes);
    if (!message) {
      link_->close(frame.peer, "a frame " + message.error().message);
      return;
    }
    if (auto* run = std::get_if<RunMessage>(&*message)) return on(*run, frame);
    if (frame.bulk) link_->consumed(frame);
    if (lead_ != frame.peer) return;  // other nodes may send messages of runs and nothing else
    std::visit([this](auto& one) { on(one); }, *message);
  }

  // ---- What the lead says ----

  template <class Other>
  void on(const Other&) {}  // of the other direction

  void on(const Welcome& welcome) {
    own_ = welcome.node;
    said_unreachable_ = false;
    spdlog::info("joined as node {}", own_.value);
  }

  void on(const HostShare& wanted) {
    Share* const old = share_of(wanted.job);
    if (old && old->wanted.epoch >= wanted.epoch) return;
    drop(wanted.job);
    Share& share = shares_[wanted.job];
    share.wanted = wanted;
    if (const std::string lack = lacking(wanted); !lack.empty()) return fail(wanted.job, wanted.epoch, lack);
    if (cache_->find(wanted.solution)) return load(share);
    if (wanted_blobs_.insert(wanted.solution).second) to_lead(WantBlob{wanted.solution, 0});
  }

  void on(const BlobPart& part) {
    if (!wanted_blobs_.count(part.hash)) return;
    const Expected<bool> whole = cache_->append(part.hash, part.offset, part.total, part.bytes);
    if (whole && !*whole) return to_lead(WantBlob{part.hash, part.offset + part.bytes.size()});
    wanted_blobs_.erase(part.hash);
    std::vector<Share*> waiting;
    for (auto& [job, share] : shares_)
      if (share.wanted.solution == part.hash && !share.loading) waiting.push_back(&share);
    for (Share* share : waiting)
      if (whole)
        load(*share);
      else
        return fail(share->wanted.job, share->wanted.epoch, whole.error().text());
  }

  void on(const ReleaseShare& release) {
    const Share* const share = share_of(release.job);
    if (share && share->wanted.epoch <= release.epoch) drop(release.job);
  }

  void on(const CollectCells& collect) {
    Share* const share = share_at(collect.job, collect.epoch);
    if (!share || !share->started) return;
    const Link link = *link_;
    const PeerId lead = *lead_;
    share->run->collect(
        [link, lead](const CellImage& image) { link.send_bulk(lead, std::make_shared<const Bytes>(encode(image))); });
  }

  void on(const Dismissed& dismissed) { spdlog::warn("dismissed by the controller: {}", dismissed.reason); }

  void on(const RunMessage& message, const FrameArrived& frame) {
    Share* const share = share_at(message.job, message.epoch);
    Expected<Message> content = decode(message.message);
    const bool is_light = content && std::holds_alternative<HemicubeMessage>(*content);
    const bool taken =
        content && share && share->started && share->run->deliver(message, std::move(*content), frame.bytes->size());
    if (!content) spdlog::warn("a message of job {} is refused: {}", message.job.value, content.error().text());
    if (!frame.bulk) return;
    if (taken && is_light)
      share->unpaid[CellId{message.to}].push_back({frame.peer, frame.bytes->size()});
    else
      link_->consumed(frame);
  }

  // ---- Loading ----

  /// Memory that other loads are about to take counts as taken. @returns empty: there is room
  std::string lacking(const HostShare& wanted) const {
    std::uint64_t free = options_.free_memory_bytes();
    for (const auto& [job, share] : shares_)
      if (job != wanted.job && !share.run) free -= std::min(free, share.wanted.bytes);
    if (wanted.bytes <= free) return "";
    const auto megabytes = [](std::uint64_t bytes) { return std::to_string(bytes / 1'000'000) + " MB"; };
    return "it needs " + megabytes(wanted.bytes) + " of memory, " + megabytes(free) + " are free";
  }

  void load(Share& share) {
    share.loading = true;
    ++*loads_;
    const std::optional<std::string> path = cache_->find(share.wanted.solution);
    const caf::actor node = caf::actor_cast<caf::actor>(self_);
    const auto known = last_solution_hash_ == share.wanted.solution ? last_solution_ : nullptr;
    // On a thread of its own: reading and building trees takes seconds.
    self_->system().spawn<caf::detached>([node, path, known, wanted = share.wanted, own = own_, options = options_,
                                          loads = loads_](caf::event_based_actor* loader) {
      Loaded loaded{wanted.job, wanted.epoch, nullptr, nullptr, ""};
      try {
        std::shared_ptr<const Solution> solution = known;
        if (!solution) {
          Expected<Solution> read =
              path ? options.read_solution(*path) : Expected<Solution>(Error{ErrorCode::io, "", "lost from the cache"});
          if (!read)
            loaded.reason = read.error().text();
          else
            solution = std::make_shared<const Solution>(std::move(*read));
        }
        if (solution) {
          Expected<std::shared_ptr<HostedRun>> made = HostedRun::make(wanted, own, solution, options.threads);
          loaded.solution = solution;
          if (made)
            loaded.run = *made;
          else
            loaded.reason = made.error().text();
        }
      } catch (const std::bad_alloc&) {
        loaded.reason = "out of memory";
      } catch (const std::exception& error) {
        loaded.reason = error.what();
      }
      loader->send(node, std::move(loaded));
      --*loads;
    });
  }

  void on(Loaded& loaded) {
    Share* const share = share_at(loaded.job, loaded.epoch);
    if (!share) return;
    if (!loaded.run) return fail(loaded.job, loaded.epoch, loaded.reason);
    share->run = loaded.run;
    last_solution_ = loaded.solution, last_solution_hash_ = share->wanted.solution;
    dial_partners(*share);
    start_if_ready(*share);
  }

  void dial_partners(const Share& share) {
    for (const NodeId node : share.run->partners())
      if (const Peer* peer = peer_of(share, node); peer && !peers_.count(peer->boot_id))
        link_->dial(peer->host, peer->port);
  }

  void start_if_ready(Share& share) {
    if (!share.run || share.started) return;
    std::map<NodeId, PeerId> reached;
    for (const NodeId node : share.run->partners()) {
      const Peer* const peer = peer_of(share, node);
      const auto found = peer ? peers_.find(peer->boot_id) : peers_.end();
      if (found == peers_.end()) return;
      reached[node] = found->second;
    }
    share.reached = std::move(reached);
    share.started = true;
    const Link link = *link_;
    const auto send = [link, counters = options_.counters, lead = *lead_, job = share.wanted.job,
                       epoch = share.wanted.epoch, cells = share.wanted.cells,
                       peers = share.reached](const Address& to, const Message& message) -> std::size_t {
      PeerId peer = lead;
      if (const auto* cell = std::get_if<CellId>(&to)) {
        const auto found = peers.find(cells[cell->value]);
        if (found == peers.end()) return 0;  // no neighbour: nobody sends there
        peer = found->second;
      }
      if (const auto* result = std::get_if<ColumnResult>(&message))
        counters->rays += std::accumulate(result->rays.begin(), result->rays.end(), std::uint64_t{0});
      auto bytes = std::make_shared<const Bytes>(encode(ClusterMessage(run_message(job, epoch, to, message))));
      const std::size_t count = bytes->size();
      const bool is_bulk =
          std::holds_alternative<HemicubeMessage>(message) || std::holds_alternative<ColumnResult>(message);
      if (is_bulk)
        link.send_bulk(peer, std::move(bytes));
      else
        link.send_control(peer, std::move(bytes));
      return count;
    };
    share.run->start(self_->system(), send);
    for (const caf::actor& actor : share.run->actors()) {
      self_->monitor(actor);
      watched_[actor.address()] = {share.wanted.job, share.wanted.epoch};
    }
    to_lead(Hosted{share.wanted.job, share.wanted.epoch});
  }

  void on(const caf::down_msg& down) {
    const auto found = watched_.find(down.source);
    if (found == watched_.end()) return;
    const auto [job, epoch] = found->second;
    watched_.erase(found);
    if (down.reason && down.reason != caf::exit_reason::kill) fail(job, epoch, text(down.reason));
  }

  void fail(JobId job, Epoch epoch, const std::string& reason, bool is_unreachable = false) {
    if (!share_at(job, epoch)) return;
    spdlog::warn("job {} can not be hosted here: {}", job.value, reason);
    drop(job);
    to_lead(HostFailed{job, epoch, reason.substr(0, 1000), is_unreachable});
  }

  // ---- Time ----

  /// Senders get their credit back for what the cells have processed.
  void pay() {
    ++ticks_;
    for (auto& [job, share] : shares_) {
      if (!share.started) continue;
      for (auto& [cell, queue] : share.unpaid) {
        std::uint64_t& paid = share.paid[cell];
        for (const std::uint64_t done = share.run->processed(cell); paid < done && !queue.empty(); ++paid) {
          link_->consumed(queue.front().peer, queue.front().bytes);
          queue.pop_front();
        }
        if (queue.empty()) paid = std::max(paid, share.run->processed(cell));
      }
    }
  }

  void hold(PeerId peer, bool is_blocked) {
    if (is_blocked)
      blocked_.insert(peer);
    else
      blocked_.erase(peer);
    for (auto& [job, share] : shares_)
      if (share.started) {
        bool held = false;
        for (const auto& [node, reached] : share.reached) held |= blocked_.count(reached) > 0;
        share.run->hold(held);
      }
  }

  /// Share of a core that the actors had while they worked; while they rest, how punctual this actor is: who is stopped most of
  /// the time hears its ticks late.
  double pace(double seconds) {
    HostedRun::Worked worked;
    for (auto& [job, share] : shares_) {
      if (!share.started) continue;
      const HostedRun::Worked now = share.run->worked();
      worked.busy_ns += now.busy_ns - share.seen.busy_ns, worked.cpu_ns += now.cpu_ns - share.seen.cpu_ns;
      share.seen = now;
    }
    const double punctual = std::chrono::duration<double>(tick).count() * std::exchange(ticks_, 0) / seconds;
    if (worked.busy_ns < busy_enough_ns) return std::min(punctual, 1.0);
    return std::min(static_cast<double>(worked.cpu_ns) / static_cast<double>(worked.busy_ns), 1.0);
  }

  void report() {
    // A partner that could not be reached may be by now.
    for (const auto& [job, share] : shares_)
      if (share.run && !share.started) dial_partners(share);
    count();
    if (!lead_ || own_.value == 0) return;
    const double now = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    timespec used{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    const double cpu = static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
    NodeReport report;
    if (now > reported_s_ && reported_s_ > 0) {
      report.busy_share = (cpu - reported_cpu_) / (now - reported_s_) / options_.facts.cores;
      report.pace = pace(now - reported_s_);
    }
    reported_s_ = now, reported_cpu_ = cpu;
    report.free_memory_bytes = options_.free_memory_bytes();
    report.used_memory_bytes = options_.used_memory_bytes();
    report.at_ns = static_cast<std::uint64_t>(1e9 * now);
    report.shots = counters().shots - joined_shots_, report.rays = counters().rays - joined_rays_;
    for (const auto& [job, share] : shares_)
      if (share.started)
        for (ActorLoad& load : share.run->load()) report.actors.push_back(std::move(load));
    to_lead(report);
  }

  void dial_lead() {
    if (!lead_ && !is_paused_) link_->dial(options_.lead_host, options_.lead_port);
  }

 private:
  NodeCounters& counters() { return *options_.counters; }
  /// Of what is hosted, and of all connections.
  void count() {
    std::uint32_t started = 0, cells = 0, workers = 0;
    for (auto& [job, share] : shares_) {
      count_work(share);
      if (!share.started) continue;
      ++started, workers += share.wanted.workers;
      cells += static_cast<std::uint32_t>(std::count(share.wanted.cells.begin(), share.wanted.cells.end(), own_));
    }
    counters().shares = started, counters().cells = cells, counters().workers = workers;
    std::map<PeerId, std::pair<std::uint64_t, std::uint64_t>> seen;
    for (const auto& peer : link_->monitor().peers()) {
      const auto [in, out] = traffic_[peer->peer];
      seen[peer->peer] = {peer->bytes_in, peer->bytes_out};
      counters().bytes_in += seen[peer->peer].first - in, counters().bytes_out += seen[peer->peer].second - out;
    }
    traffic_ = std::move(seen);
  }
  void count_work(Share& share) {
    if (!share.started) return;
    const HostedRun::Worked now = share.run->worked();
    counters().shots += now.shots - share.counted.shots, counters().rays += now.rays - share.counted.rays;
    share.counted = now;
  }
  void drop(JobId job) {
    if (Share* const share = share_of(job)) count_work(*share);
    shares_.erase(job);
  }
  void drop_shares() {
    while (!shares_.empty()) drop(shares_.begin()->first);
  }
  void leave(const std::string& reason) {
    if (lead_) {
      to_lead(Leaving{reason});
      link_->close(*lead_, reason);
    }
    counters().connected = false;
    lead_.reset();
    drop_shares();
    wanted_blobs_.clear();
  }

  Share* share_of(JobId job) {
    const auto found = shares_.find(job);
    return found == shares_.end() ? nullptr : &found->second;
  }
  Share* share_at(JobId job, Epoch epoch) {
    Share* const share = share_of(job);
    return share && share->wanted.epoch == epoch ? share : nullptr;
  }
  static const Peer* peer_of(const Share& share, NodeId node) {
    for (const Peer& peer : share.wanted.peers)
      if (peer.node == node) return &peer;
    return nullptr;
  }
  void to_lead(const ClusterMessage& message) {
    if (lead_) link_->send_control(*lead_, std::make_shared<const Bytes>(encode(message)));
  }

  caf::event_based_actor* self_ = nullptr;
  NodeOptions options_;
  std::shared_ptr<BlobCache> cache_;
  std::optional<Link> link_;
  std::optional<PeerId> lead_;
  bool said_unreachable_ = false, is_paused_ = false;
  NodeId own_;
  std::map<std::uint64_t, PeerId> peers_;  ///< other nodes, by boot id
  std::map<std::uint64_t, unsigned> dials_;
  std::set<PeerId> blocked_;
  std::map<JobId, Share> shares_;
  std::set<std::string> wanted_blobs_;
  std::map<caf::actor_addr, std::pair<JobId, Epoch>> watched_;
  std::string last_solution_hash_;
  std::shared_ptr<const Solution> last_solution_;
  double reported_s_ = 0, reported_cpu_ = 0;
  unsigned ticks_ = 0;                            ///< since the last report
  std::shared_ptr<std::atomic<unsigned>> loads_;  ///< threads that load a run
  std::uint64_t joined_shots_ = 0, joined_rays_ = 0;                   ///< counters when it joined
  std::map<PeerId, std::pair<std::uint64_t, std::uint64_t>> traffic_;  ///< counted, in and out
};

using NodeSelf = caf::stateful_actor<NodeState>;

struct UseLink {
  Link link;
};
/// Whether the node may work.
struct MayWork {
  bool yes = true;
};

caf::behavior node_actor(NodeSelf* self, const NodeOptions& options, std::shared_ptr<BlobCache> cache,
                         std::shared_ptr<std::atomic<unsigned>> loads, bool may_work) {
  report_failures(self, "node");
  self->state.begin(self, options, std::move(cache), std::move(loads), may_work);
  self->set_down_handler([self](caf::down_msg& down) { self->state.on(down); });
  self->set_exit_handler([self](caf::exit_msg& exit) {
    self->state.end();
    self->quit(exit.reason);
  });
  return {
      [self](const UseLink& use) { self->state.use(use.link); },
      [self](const LinkUp& up) { self->state.on(up); },
      [self](const LinkDown& down) { self->state.on(down); },
      [self](const DialFailed& failed) { self->state.on(failed); },
      [self](const FrameArrived& frame) { self->state.on(frame); },
      [self](const LinkBlocked& blocked) { self->state.hold(blocked.peer, true); },
      [self](const LinkReady& ready) { self->state.hold(ready.peer, false); },
      [self](Loaded& loaded) { self->state.on(loaded); },
      [self](const MayWork& may) { may.yes ? self->state.go_on() : self->state.pause(); },
      [self](dial_atom) { self->state.dial_lead(); },
      [self](tick_atom) {
        self->state.pay();
        self->delayed_send(self, tick, tick_atom{});
      },
      [self](report_atom) {
        self->state.report();
        self->delayed_send(self, report_every, report_atom{});
      },
  };
}

}  // namespace

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Loaded)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::UseLink)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::MayWork)

namespace lichthof::actors {

Status run_node(const NodeOptions& options, const std::atomic<bool>& stop) {
  const auto cache = std::make_shared<BlobCache>(options.cache, options.cache_bytes);
  if (Status opened = cache->open(); !opened) return opened;
  SystemOptions system_options;
  system_options.network = true;
  SystemConfig config(system_options);
  caf::actor_system system(config);
  const auto loads = std::make_shared<std::atomic<unsigned>>(0);
  const bool may_work = !options.may_work || options.may_work();
  const caf::actor node = system.spawn<caf::detached>(node_actor, options, cache, loads, may_work);
  const auto ended = [&](Status status) {
    caf::anon_send_exit(node, caf::exit_reason::user_shutdown);
    caf::scoped_actor waiting{system};
    waiting->wait_for(node);
    const auto patience = std::chrono::steady_clock::now() + load_may_last;
    while (*loads > 0 && std::chrono::steady_clock::now() < patience) std::this_thread::sleep_for(20ms);
    if (*loads > 0 && options.abandon) options.abandon();
    return status;
  };
  Expected<Link> link = Link::start(system, node, options.link);
  if (!link) return ended(link.error());
  if (Expected<std::uint16_t> port = link->listen(options.listen_host, options.listen_port); !port) {
    link->stop();
    return ended(port.error());
  }
  caf::anon_send(node, UseLink{*link});
  for (int looks = 1; !stop; ++looks) {
    std::this_thread::sleep_for(50ms);
    if (options.may_work && looks % 10 == 0) caf::anon_send(node, MayWork{options.may_work()});
  }
  return ended(Done{});
}

}  // namespace lichthof::actors
