/// The driver of virtual time: it runs the same machines as the actors do, on as many nodes as one likes, without a clock.
///
/// A node executes one step at a time, of its machines in turn. A step's effects are computed when it begins and leave
/// when it ends, `cost` later; whatever arrives meanwhile is filed at once, as a mailbox would, and cannot change them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <variant>
#include <vector>

#include "sim/cost_model.hpp"
#include "sim/event_queue.hpp"
#include "sim/network_model.hpp"

namespace lichthof::sim {

struct SimulationOptions {
  NetworkOptions network;
  CostModel cost;
  std::uint64_t seed = 1;
  std::uint64_t max_events = 100'000'000;  ///< a run that needs more is taken for a livelock
};

/// What just happened; for observers such as the oracle. Exactly one of the pointers is set.
struct Observation {
  Address machine;
  const Envelope* accepted = nullptr;
  const Effects* stepped = nullptr;
  Instant now;
};

struct NodeUse {
  std::uint64_t steps = 0;
  Duration busy;
};

struct SimulationReport {
  Instant end;  ///< when the last step ended
  std::uint64_t events = 0, messages = 0, bytes = 0, steps = 0;
  bool exhausted = false;  ///< max_events was reached
  std::map<NodeId, NodeUse> nodes;
};

class Simulation {
 public:
  explicit Simulation(const SimulationOptions& options);

  /// Puts a machine on a node. The caller keeps the machine, and keeps it alive.
  template <class M>
  void add(const Address& address, NodeId node, M& machine) {
    add_machine(address, node, std::make_unique<MachineOf<M>>(machine));
  }
  /// Speed of a node (1 unless set), relative to the machine the cost model was measured on.
  void set_speed(NodeId node, double speed) { nodes_[node].speed = speed; }
  void set_observer(std::function<void(const Observation&)> observer) { observer_ = std::move(observer); }

  /// A message from outside, delivered at `at`.
  void post(Envelope envelope, Instant at);
  /// Looks for work again after a machine was changed by a direct call (Controller::stop).
  void nudge(const Address& address);

  /// Handles the next event. @returns false when nothing is left to happen
  bool run_one();
  /// Until nothing is left to happen, or max_events.
  SimulationReport run();
  const SimulationReport& report() const { return report_; }
  Instant now() const { return events_.now(); }

 private:
  struct Machine {
    virtual ~Machine() = default;
    virtual void accept(const Envelope& envelope, Instant now) = 0;
    virtual bool has_work() const = 0;
    virtual Effects step(Instant now) = 0;
  };
  template <class M>
  struct MachineOf final : Machine {
    explicit MachineOf(M& m) : machine(m) {}
    void accept(const Envelope& envelope, Instant now) override { machine.accept(envelope, now); }
    bool has_work() const override { return machine.has_work(); }
    Effects step(Instant now) override { return machine.step(now); }
    M& machine;
  };
  struct Place {
    NodeId node;
    std::unique_ptr<Machine> machine;
  };
  struct Node {
    std::vector<Address> machines;
    std::size_t next = 0;  ///< whose turn it is
    bool busy = false;
    double speed = 1;
  };
  struct Delivery {
    Envelope envelope;
  };
  struct StepEnd {
    Address machine;
    Effects effects;
  };
  struct Wake {
    Address machine;
  };
  using Event = std::variant<Delivery, StepEnd, Wake>;

  void add_machine(const Address& address, NodeId node, std::unique_ptr<Machine> machine);
  void handle(Delivery& delivery);
  void handle(StepEnd& end);
  void handle(Wake& wake) { nudge(wake.machine); }
  void start_step(NodeId node);

  SimulationOptions options_;
  NetworkModel network_;
  EventQueue<Event> events_;
  std::map<Address, Place> machines_;
  std::map<NodeId, Node> nodes_;
  std::function<void(const Observation&)> observer_;
  SimulationReport report_;
};

}  // namespace lichthof::sim
