/// The lead's nodes: their links, signs of life, what they say, and the blobs they are handed.
#include <spdlog/spdlog.h>

#include <cmath>

#include "actors/cluster/lead_state.hpp"
#include "actors/codec.hpp"

namespace lichthof::actors {

namespace {

constexpr auto complaint_waits = Duration{12'000'000'000};  // longer than a lease: who is silent is lost by then

}  // namespace

// ---- The link ----

void LeadState::on(const LinkUp& up) {
  if (up.who.role != Role::node) return link_->close(up.peer, "only nodes may talk to this port");
  strangers_[up.peer] = up;
}

void LeadState::on(const LinkDown& down) {
  strangers_.erase(down.peer);
  const auto found = node_of_.find(down.peer);
  if (found == node_of_.end()) return;
  const NodeId node = found->second;
  spdlog::warn("node {} ({}) is gone: {}", node.value, nodes_[node].name, down.reason);
  forget(node);
  dispatcher_.node_left(node, down.reason, clock_.now());
  step();
}

void LeadState::on(const FrameArrived& frame) {
  Expected<ClusterMessage> message = decode_cluster(*frame.bytes);
  if (frame.bulk) link_->consumed(frame);
  if (!message) return link_->close(frame.peer, "a frame " + message.error().message);
  if (const auto* registration = std::get_if<Registration>(&*message)) return admit(frame.peer, *registration);
  const auto found = node_of_.find(frame.peer);
  if (found == node_of_.end()) return link_->close(frame.peer, "it did not register");
  std::visit([&, node = found->second](auto& one) { on(node, one); }, *message);
  step();
}

// ---- What nodes say ----

void LeadState::admit(PeerId peer, const Registration& facts) {
  const auto stranger = strangers_.find(peer);
  if (stranger == strangers_.end()) return;
  if (facts.cores < 1 || facts.cores > 4096 || !(facts.rays_per_s >= 0 && facts.rays_per_s < 1e15) ||
      facts.memory_bytes > 1ull << 50)
    return link_->close(peer, "what it says of itself can not be");
  const NodeId node{++last_node_};
  node_of_[peer] = node;
  KnownNode& known = nodes_[node];
  known = {stranger->second.who.name,
           stranger->second.version,
           peer,
           {node, stranger->second.host, stranger->second.port, stranger->second.boot_id},
           {},
           {}};
  strangers_.erase(stranger);
  spdlog::info("node {} ({}) joined: {} cores, {:.1f} Mray/s each, {:.1f} GiB", node.value, known.name, facts.cores,
               facts.rays_per_s / 1e6, static_cast<double>(facts.memory_bytes) / (1u << 30));
  dispatcher_.node_joined(node, {known.name, facts.cores, facts.memory_bytes, facts.rays_per_s}, clock_.now());
  to_node(node, Welcome{node});
  step();
}

void LeadState::on(NodeId node, NodeReport& report) {
  dispatcher_.node_reported(node, report.free_memory_bytes, clock_.now());
  const auto is_slow = [&] {
    const auto known = dispatcher_.nodes().find(node);
    return known != dispatcher_.nodes().end() && known->second.pace.is_slow();
  };
  const bool was_slow = is_slow();
  dispatcher_.node_paced(node, report.pace, clock_.now());
  if (is_slow() != was_slow)
    spdlog::info("node {} {}", nodes_[node].name, was_slow ? "is well again" : "has become slow: its cells leave");
  if (!std::isfinite(report.busy_share)) report.busy_share = 0;
  KnownNode& known = nodes_[node];
  known.before = std::exchange(known.report, std::move(report));
}

void LeadState::on(NodeId node, Leaving& leaving) {
  spdlog::info("node {} ({}) leaves: {}", node.value, nodes_[node].name, leaving.reason);
  forget(node);
  dispatcher_.node_parted(node, leaving.reason.substr(0, 200), clock_.now());
}

void LeadState::on(NodeId node, Hosted& hosted) { dispatcher_.hosted(node, hosted.job, hosted.epoch, clock_.now()); }

void LeadState::on(NodeId node, HostFailed& failed) {
  if (!run_at(failed.job, failed.epoch)) return;
  say(failed.job, "node " + nodes_[node].name + " can not host it: " + failed.reason);
  // The node that can't be reached is usually gone, and the lead about to notice: then the job is hosted anew anyway.
  if (failed.is_unreachable) return complaints_.push_back({node, failed, clock_.now() + complaint_waits});
  dispatcher_.host_failed(node, failed.job, failed.epoch, failed.reason, clock_.now());
}

void LeadState::on(NodeId node, WantBlob& want) {
  std::uint64_t total = 0;
  Expected<Bytes> bytes = blobs_->part(want.hash, want.offset, blob_part_bytes, total);
  if (!bytes) return spdlog::warn("node {} wants a blob: {}", node.value, bytes.error().text());
  for (const auto& [id, job] : jobs_)
    if (job.run && job.begun_with == want.hash) dispatcher_.still_hosting(node, id, job.run->epoch(), clock_.now());
  to_node(node, BlobPart{want.hash, want.offset, total, std::move(*bytes)}, true);
}

void LeadState::on(NodeId node, RunMessage& message) {
  RunLead* const run = run_at(message.job, message.epoch);
  if (!run) return;
  Expected<Message> content = decode(message.message);
  if (!content) return spdlog::warn("a message of job {} is refused: {}", message.job.value, content.error().text());
  run->accept(node, message, std::move(*content), clock_.now());
  look_at(*run);
}

void LeadState::on(NodeId node, CellImage& image) {
  RunLead* const run = run_at(image.job, image.epoch);
  if (!run) return;
  dispatcher_.still_keeping(image.job, image.epoch, clock_.now());
  run->accept(node, std::move(image), clock_.now());
  look_at(*run);
}

/// Who could not be reached and still counts as there makes its accuser unfit.
void LeadState::hear_complaints() {
  const Instant now = clock_.now();
  for (; !complaints_.empty() && complaints_.front().due <= now; complaints_.pop_front()) {
    const Complaint& complaint = complaints_.front();
    const HostFailed& failed = complaint.failed;
    if (run_at(failed.job, failed.epoch))
      dispatcher_.host_failed(complaint.node, failed.job, failed.epoch, failed.reason, now);
  }
}

// ---- Nodes by name, and their going ----

Status LeadState::drain(const std::string& node_name, bool is_draining) {
  if (!is_draining && dispatcher_.draining().contains(node_name))  // it may be away
    return decided(dispatcher_.drain(node_name, false));
  return for_named(node_name, [&](NodeId node) { return dispatcher_.drain(node, is_draining, clock_.now()); });
}

Status LeadState::kick(const std::string& node_name) {
  return for_named(node_name, [&](NodeId node) { return dispatcher_.kick(node, clock_.now()); });
}

Status LeadState::for_named(const std::string& wanted, const std::function<Status(NodeId)>& act) {
  for (const auto& [id, known] : nodes_)
    if (known.name == wanted || std::to_string(id.value) == wanted) return decided(act(id));
  return Error{ErrorCode::bad_input, "node " + wanted, "there is none"};
}

void LeadState::carry_out(const DropNode& order) {
  const auto found = nodes_.find(order.node);
  if (found == nodes_.end()) return;
  to_node(order.node, Dismissed{order.reason});
  link_->close(found->second.link, order.reason);
  forget(order.node);
}

void LeadState::carry_out(const NodeDrained& order) { spdlog::info("node {} is drained", nodes_[order.node].name); }

void LeadState::forget(NodeId node) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  node_of_.erase(found->second.link);
  nodes_.erase(found);
  for (auto& [id, job] : jobs_)
    if (job.run && job.run->pass() == Pass::picture && job.run->hosts(node)) {
      job.run->lose_workers(node, clock_.now());
      look_at(*job.run);
    }
}

void LeadState::to_node(NodeId node, const ClusterMessage& message, bool is_bulk) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  auto bytes = std::make_shared<const Bytes>(encode(message));
  if (is_bulk)
    link_->send_bulk(found->second.link, std::move(bytes));
  else
    link_->send_control(found->second.link, std::move(bytes));
}

}  // namespace lichthof::actors
