/// The nodes of a lab in virtual time, the links to them, and what goes wrong with either.
#include <algorithm>
#include <type_traits>
#include <utility>

#include "core/base/check.hpp"
#include "sim/lab_run.hpp"

namespace lichthof::sim {

namespace {
constexpr double column_work = 30;  // in patches
constexpr Duration seconds(std::int64_t count) { return {count * 1'000'000'000}; }
}  // namespace

// ---- Links ------------------------------------------------------------------------------------------------------------

/// A link keeps the order, as TCP does; a cut holds messages back until it is mended.
Instant LabRun::arrival(std::uint32_t slot, bool to_node) {
  Node& node = nodes_[slot];
  Instant& last = node.last_arrival[to_node];
  const Duration delay = random_.below(20) == 0 ? drawn(0, 1.5) : drawn(0.0001, 0.05);
  last = std::max({last, events_.now() + delay, node.cut_off_until});
  return last;
}

void LabRun::send_to_controller(std::uint32_t slot, Message message) {
  events_.push(arrival(slot, false), ToController{slot, nodes_[slot].link, std::move(message)});
}

/// A node that hangs does and hears everything later.
bool LabRun::postponed(Event& event) {
  std::optional<std::uint32_t> slot;
  std::visit(
      [&](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<E, ToNode> || std::is_same_v<E, LinkLostByNode> || std::is_same_v<E, Connect> ||
                      std::is_same_v<E, Report> || std::is_same_v<E, Ready> || std::is_same_v<E, Worked>)
          slot = e.slot;
      },
      event);
  if (!slot || (nodes_[*slot].hung_until <= events_.now() && backlogs_[*slot].empty())) return false;
  std::deque<Event>& backlog = backlogs_[*slot];
  if (backlog.empty()) events_.push(nodes_[*slot].hung_until, Resume{*slot});
  backlog.push_back(std::move(event));
  return true;
}

void LabRun::handle(Resume& event) {
  if (nodes_[event.slot].hung_until > events_.now()) return events_.push(nodes_[event.slot].hung_until, event);
  for (Event& waiting : std::exchange(backlogs_[event.slot], {})) std::visit([this](auto& e) { handle(e); }, waiting);
}

void LabRun::handle(Boot& event) {
  Node& node = nodes_[event.slot];
  if (node.alive) return;
  node.alive = true;
  events_.push(events_.now() + drawn(0.05, 0.2), Connect{event.slot, node.life});
}

void LabRun::handle(Connect& event) {
  Node& node = nodes_[event.slot];
  if (!node.alive || node.life != event.life || node.link != 0) return;
  if (!controller_is_up_) return events_.push(events_.now() + drawn(0.3, 0.7), event);
  node.link = ++last_link_;
  send_to_controller(event.slot, {Kind::join, {}, {}});
  events_.push(events_.now() + seconds(1), Report{event.slot, node.link});
}

void LabRun::handle(LinkLostByNode& event) {
  Node& node = nodes_[event.slot];
  if (event.link == 0 || node.link != event.link) return;
  node.link = 0;
  node.shares.clear();
  events_.push(events_.now() + drawn(0.1, 1), Connect{event.slot, node.life});
}

// ---- Work -------------------------------------------------------------------------------------------------------------

void LabRun::handle(Report& event) {
  const Node& node = nodes_[event.slot];
  if (node.link != event.link) return;
  Message report{Kind::report, {}, {}, {}, node.facts.memory_bytes - node.used_bytes()};
  report.pace = node.pace;
  send_to_controller(event.slot, std::move(report));
  events_.push(events_.now() + seconds(1), event);
}

void LabRun::handle(ToNode& event) {
  Node& node = nodes_[event.slot];
  if (node.link != event.link) return;
  Message& message = event.message;
  const std::pair key{message.job, message.epoch};
  const auto found = node.shares.find(key);
  if (message.kind == Kind::host) {
    if (found != node.shares.end()) oracle_.complain("a node is told twice to host a share");
    node.shares[key] = {message.pass, message.bytes, false, false, std::move(message.rest), {}};
    const bool can_go_wrong = options_.with_faults && !is_calm_;
    const bool fails = can_go_wrong && random_.below(40) == 0;
    const bool is_never_heard_of = can_go_wrong && random_.below(60) == 0;
    report_.late_hostings += is_never_heard_of;
    if (is_never_heard_of) return;
    events_.push(events_.now() + drawn(0.02, 1.0), Ready{event.slot, event.link, message.job, message.epoch, fails});
    return;
  }
  if (found == node.shares.end()) return;
  ModelShare& share = found->second;
  if (message.kind == Kind::release) {
    node.shares.erase(found);
  } else if (message.kind == Kind::begin) {
    if (!share.hosted || share.begun) oracle_.complain("a share begins before it is hosted, or twice");
    share.begun = true;
    share.since = events_.now();
    if (share.pass == Pass::radiosity) go_on(event.slot, message.job, message.epoch, share);
  } else if (message.kind == Kind::checkpoint) {
    if (options_.with_faults && !is_calm_ && random_.below(60) == 0) {
      ++report_.late_checkpoints;
      return;
    }
    Message part{Kind::checkpoint_part, message.job, message.epoch};
    const double work = share.work(), done = 1e-9 * double((events_.now() - share.since).ns) * node.speed();
    for (const auto& [cell, rest] : share.rest) part.rest[cell] = work > done ? rest * (1 - done / work) : 0;
    send_to_controller(event.slot, std::move(part));
  } else if (message.kind == Kind::column) {
    const double work = message.columns.size() * column_work * (0.5 + random_.unit());
    events_.push(events_.now() + Duration{static_cast<std::int64_t>(work / node.speed() * 1e9)},
                 Worked{event.slot, event.link, message.job, message.epoch, message.columns, {}});
  }
}

/// Radiosity from now on at the node's present speed.
void LabRun::go_on(std::uint32_t slot, JobId job, Epoch epoch, ModelShare& share) {
  const Duration work{static_cast<std::int64_t>(share.work() / nodes_[slot].speed() * 1e9)};
  events_.push(events_.now() + work, Worked{slot, nodes_[slot].link, job, epoch, {}, share.since});
}

void LabRun::set_pace(std::uint32_t slot, double pace) {
  Node& node = nodes_[slot];
  const double before = node.speed();
  node.pace = pace;
  for (auto& [key, share] : node.shares) {
    if (!share.begun || share.pass != Pass::radiosity) continue;
    const double work = share.work(), done = 1e-9 * double((events_.now() - share.since).ns) * before;
    for (auto& [cell, rest] : share.rest) rest = work > done ? rest * (1 - done / work) : 0;
    share.since = events_.now();
    go_on(slot, key.first, key.second, share);
  }
}

void LabRun::handle(Ready& event) {
  Node& node = nodes_[event.slot];
  const auto share = node.shares.find({event.job, event.epoch});
  if (node.link != event.link || share == node.shares.end()) return;
  share->second.hosted = !event.fails;
  send_to_controller(event.slot, {event.fails ? Kind::host_failed : Kind::hosted, event.job, event.epoch});
  if (event.fails) node.shares.erase(share);
}

void LabRun::handle(Worked& event) {
  const Node& node = nodes_[event.slot];
  const auto share = node.shares.find({event.job, event.epoch});
  if (node.link != event.link || share == node.shares.end()) return;
  if (!event.columns && share->second.since != event.since) return;  // another speed since then
  send_to_controller(event.slot, {event.columns ? Kind::column_done : Kind::cells_done,
                                  event.job,
                                  event.epoch,
                                  {},
                                  0,
                                  event.columns.value_or(ColumnJob{})});
}

// ---- What goes wrong --------------------------------------------------------------------------------------------------

void LabRun::handle(Fault&) {
  const std::uint32_t choice = random_.below(10);
  if (choice == 0 && controller_is_up_)
    restart_controller();
  else if (choice <= 3)
    operator_acts();
  else
    node_fault(random_.below(static_cast<std::uint32_t>(nodes_.size())));
}

void LabRun::handle(Slow& event) {
  set_pace(event.slot, event.pace);
  nodes_[event.slot].hung_until = events_.now() + event.hangs;
}

void LabRun::node_fault(std::uint32_t slot) {
  Node& node = nodes_[slot];
  switch (random_.below(4)) {
    case 0:
      return crash(slot, drawn(0.3, 20));
    case 1:
      node.hung_until = std::max(node.hung_until, events_.now() + drawn(0.5, 12));
      return;
    case 2:
      node.cut_off_until = std::max(node.cut_off_until, events_.now() + drawn(0.5, 12));
      return;
    default:
      return set_pace(slot, random_.below(2) == 0 ? 0.1 : 1);
  }
}

void LabRun::crash(std::uint32_t slot, Duration away) {
  Node& node = nodes_[slot];
  if (!node.alive) return;
  const std::uint64_t link = std::exchange(node.link, 0);
  node.alive = false;
  ++node.life;
  node.shares.clear();
  node.hung_until = events_.now();
  backlogs_[slot].clear();
  // A process that dies has its connections closed; a machine that loses power says nothing.
  if (random_.below(3) != 0) events_.push(arrival(slot, false), LinkLostByController{slot, link});
  events_.push(events_.now() + away, Boot{slot});
}

void LabRun::restart_controller() {
  ++report_.restarts;
  controller_is_up_ = false;
  runs_.clear();
  wake_is_due_.reset();
  oldest_valid_link_ = last_link_ + 1;
  for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot) {
    links_[slot] = 0;
    if (nodes_[slot].link != 0) events_.push(arrival(slot, true), LinkLostByNode{slot, nodes_[slot].link});
  }
  events_.push(events_.now() + drawn(0.2, 5), ControllerUp{});
}

void LabRun::operator_acts() {
  if (!controller_is_up_) return;
  const Instant now = events_.now();
  const NodeId node = node_of(random_.below(static_cast<std::uint32_t>(nodes_.size())));
  const JobId job{1 + random_.below(6)};
  // What is refused (a stranger, a job that has ended) is refused; the operator does not mind.
  switch (random_.below(5)) {
    case 0:
    case 1:
      (void)dispatcher_.drain(node, random_.below(3) != 0, now);
      return;
    case 2:
      (void)dispatcher_.kick(node, now);
      return;
    case 3:
      (void)dispatcher_.cancel(job, now);
      return;
    default:
      if (dispatcher_.retry(job, now)) oracle_.retried(job);
  }
}

void LabRun::handle(Calm&) {
  is_calm_ = true;
  for (std::uint32_t slot = 0; slot < nodes_.size(); ++slot) {
    set_pace(slot, 1);
    nodes_[slot].cut_off_until = events_.now();
    if (!nodes_[slot].alive) events_.push(events_.now() + seconds(1), Boot{slot});
  }
  if (controller_is_up_) end_draining();
}

/// All nodes take work again, also those that are away.
void LabRun::end_draining() {
  for (const std::string& name : std::set(dispatcher_.draining())) (void)dispatcher_.drain(name, false);
}

}  // namespace lichthof::sim
