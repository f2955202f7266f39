#include "actors/cluster/run_lead.hpp"

#include <algorithm>
#include <set>

#include "actors/drive.hpp"
#include "core/base/check.hpp"

namespace lichthof::actors {

RunLead::RunLead(const HostRun& order, const PictureSpec& picture, double eps, Send send)
    : order_(order), send_(std::move(send)) {
  if (order.pass == Pass::radiosity) {
    std::uint32_t cells = 0;
    for (const auto& [node, own] : order.cells) cells += static_cast<std::uint32_t>(own.size());
    nodes_of_cells_.resize(cells);
    for (const auto& [node, own] : order.cells)
      for (const CellId cell : own) nodes_of_cells_.at(cell.value) = node;
    controller_ = std::make_unique<Controller>(ControllerOptions{cells, eps, order.epoch});
    return;
  }
  BalancerOptions options;
  options.columns = picture.width, options.height = picture.height;
  options.workers = 0;
  options.second_runs = true;
  for (const auto& [node, threads] : order.workers) options.workers += threads;
  // One alone would get all columns as one job: none would be seen or kept before the end, none left for who joins.
  options.workers = std::max(options.workers, 2u);
  balancer_ = std::make_unique<Balancer>(options);
}

bool RunLead::hosts(NodeId node) const {
  for (const NodeId cell : nodes_of_cells_)
    if (cell == node) return true;
  for (const auto& [worker, at] : workers_)
    if (at == node) return true;
  return false;
}

std::map<NodeId, std::pair<std::uint32_t, std::uint32_t>> RunLead::add_workers(const HostRun& order) {
  std::map<NodeId, std::pair<std::uint32_t, std::uint32_t>> added;
  for (const auto& [node, threads] : order.workers) {
    added[node] = {next_worker_, threads};
    for (std::uint32_t k = 0; k < threads; ++k) workers_[WorkerId{next_worker_++}] = node;
  }
  return added;
}

void RunLead::lose_workers(NodeId node, Instant now) {
  std::vector<WorkerId> lost;
  for (const auto& [worker, at] : workers_)
    if (at == node) lost.push_back(worker);
  for (const WorkerId worker : lost) {
    workers_.erase(worker);
    if (balancer_) balancer_->accept({ToBalancer{}, ToBalancer{}, WorkerLost{worker}}, now);
  }
  drive(now);
}

void RunLead::restore(std::vector<ColumnResult> columns, Instant now) {
  MUST(balancer_ && !begun_);
  for (ColumnResult& column : columns) balancer_->accept({ToBalancer{}, ToBalancer{}, std::move(column)}, now);
  while (balancer_->has_work()) log_events(balancer_->step(now).events);
}

void RunLead::begin(Instant now) {
  begun_ = true;
  drive(now);
}

void RunLead::take_checkpoint(Instant now) {
  if (!controller_ || !begun_ || collecting_ || controller_->finished()) return;
  controller_->stop(Stop::after_pending);
  drive(now);
}

void RunLead::accept(NodeId from, const RunMessage& message, Message content, Instant now) {
  const Address to = address(message);
  if (controller_ && std::holds_alternative<ToController>(to)) {
    const auto is_theirs = [&](CellId cell) {
      return cell.value < nodes_of_cells_.size() && nodes_of_cells_[cell.value] == from;
    };
    if (const auto* ready = std::get_if<CellReady>(&content); ready && is_theirs(ready->cell))
      controller_->accept({ready->cell, to, content}, now);
    if (const auto* report = std::get_if<CellReport>(&content); report && is_theirs(report->cell))
      controller_->accept({report->cell, to, content}, now);
  }
  if (balancer_ && std::holds_alternative<ToBalancer>(to)) {
    // From a worker that was taken for lost it counts no more: its columns are somebody else's now.
    const auto is_theirs = [&](WorkerId worker) {
      const auto found = workers_.find(worker);
      return found != workers_.end() && found->second == from;
    };
    if (const auto* request = std::get_if<JobRequest>(&content); request && is_theirs(request->worker))
      balancer_->accept({request->worker, to, content}, now);
    if (const auto* result = std::get_if<ColumnResult>(&content); result && is_theirs(result->worker)) {
      const WorkerId worker = result->worker;
      balancer_->accept({worker, to, std::move(content)}, now);
    }
  }
  drive(now);
}

void RunLead::accept(NodeId from, CellImage image, Instant) {
  if (!collecting_ || image.cell.value >= nodes_of_cells_.size() || nodes_of_cells_[image.cell.value] != from) return;
  images_[image.cell] = std::move(image);
  if (images_.size() < nodes_of_cells_.size()) return;
  collecting_ = false;
  due_ = is_checkpoint_ ? Wants::checkpoint : Wants::end;
}

std::map<CellId, CellImage> RunLead::take_images(Instant now) {
  std::map<CellId, CellImage> images = std::exchange(images_, {});
  if (!ended_) {
    controller_->go_on();
    drive(now);
  }
  return images;
}

RunLead::Wants RunLead::due() { return std::exchange(due_, Wants::nothing); }

void RunLead::refresh(Instant now) {
  if (!controller_ || !begun_) return;
  controller_->refresh_progress();
  drive(now);
}

/// The machine runs while it has work; what it wants sent goes out.
void RunLead::drive(Instant now) {
  if (!begun_) return;
  const auto run = [&](auto& machine) {
    while (machine.has_work()) {
      const Effects effects = machine.step(now);
      log_events(effects.events);
      for (const Envelope& envelope : effects.outbox) {
        NodeId node;
        if (const auto* cell = std::get_if<CellId>(&envelope.to)) {
          node = nodes_of_cells_.at(cell->value);
        } else if (const auto* worker = std::get_if<WorkerId>(&envelope.to)) {
          const auto found = workers_.find(*worker);
          if (found == workers_.end()) continue;
          node = found->second;
        }
        send_(node, run_message(order_.job, order_.epoch, envelope.to, envelope.message));
      }
    }
  };
  if (controller_) run(*controller_);
  if (balancer_) run(*balancer_);
  if (controller_ && controller_->finished() && !collecting_ && !ended_ && images_.empty()) {
    is_checkpoint_ = !controller_->converged();
    ended_ = !is_checkpoint_;
    collect();
  }
  if (balancer_ && balancer_->finished() && !ended_) {
    ended_ = true;
    due_ = Wants::end;
  }
}

void RunLead::collect() {
  collecting_ = true;
  std::set<NodeId> nodes(nodes_of_cells_.begin(), nodes_of_cells_.end());
  for (const NodeId node : nodes) send_(node, CollectCells{order_.job, order_.epoch});
}

std::vector<CellReport> RunLead::cells() const {
  std::vector<CellReport> reports;
  if (controller_)
    for (const auto& report : controller_->termination().latest())
      if (report) reports.push_back(*report);
  return reports;
}

}  // namespace lichthof::actors
