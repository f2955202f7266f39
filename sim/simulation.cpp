#include "sim/simulation.hpp"

#include "core/base/check.hpp"

namespace lichthof::sim {

Simulation::Simulation(const SimulationOptions& options) : options_(options), network_(options.network, options.seed) {}

void Simulation::add_machine(const Address& address, NodeId node, std::unique_ptr<Machine> machine) {
  const bool is_new = machines_.emplace(address, Place{node, std::move(machine)}).second;
  MUST(is_new);
  nodes_[node].machines.push_back(address);
  events_.push(events_.now(), Wake{address});
}

void Simulation::post(Envelope envelope, Instant at) { events_.push(at, Delivery{std::move(envelope)}); }

void Simulation::nudge(const Address& address) { start_step(machines_.at(address).node); }

void Simulation::start_step(NodeId node_id) {
  Node& node = nodes_.at(node_id);
  if (node.busy) return;
  for (std::size_t k = 0; k < node.machines.size(); ++k) {
    const std::size_t turn = (node.next + k) % node.machines.size();
    const Address address = node.machines[turn];
    Machine& machine = *machines_.at(address).machine;
    if (!machine.has_work()) continue;
    node.next = turn + 1;
    node.busy = true;
    Effects effects = machine.step(events_.now());
    if (observer_) observer_({address, nullptr, &effects, events_.now()});
    const Duration cost = options_.cost.duration(effects.work, node.speed);
    NodeUse& use = report_.nodes[node_id];
    ++use.steps;
    ++report_.steps;
    use.busy.ns += cost.ns;
    events_.push(events_.now() + cost, StepEnd{address, std::move(effects)});
    return;
  }
}

void Simulation::handle(Delivery& delivery) {
  const auto place = machines_.find(delivery.envelope.to);
  if (place == machines_.end()) return;  // a machine that does not exist (any more) hears nothing
  place->second.machine->accept(delivery.envelope, events_.now());
  if (observer_) observer_({delivery.envelope.to, &delivery.envelope, nullptr, events_.now()});
  start_step(place->second.node);
}

void Simulation::handle(StepEnd& end) {
  const NodeId from_node = machines_.at(end.machine).node;
  for (Envelope& envelope : end.effects.outbox) {
    const auto to = machines_.find(envelope.to);
    const NodeId to_node = to == machines_.end() ? from_node : to->second.node;
    const std::size_t bytes = wire_bytes(envelope.message);
    ++report_.messages;
    report_.bytes += bytes;
    const Instant at = network_.arrival({envelope.from, envelope.to, from_node, to_node}, bytes, events_.now());
    events_.push(at, Delivery{std::move(envelope)});
  }
  if (end.effects.wake_at) events_.push(std::max(*end.effects.wake_at, events_.now()), Wake{end.machine});
  nodes_.at(from_node).busy = false;
  report_.end = events_.now();
  start_step(from_node);
}

bool Simulation::run_one() {
  if (events_.empty()) return false;
  if (report_.events >= options_.max_events) {
    report_.exhausted = true;
    return false;
  }
  ++report_.events;
  Event event = events_.pop();
  std::visit([this](auto& e) { handle(e); }, event);
  return true;
}

SimulationReport Simulation::run() {
  while (run_one()) {
  }
  return report_;
}

}  // namespace lichthof::sim
