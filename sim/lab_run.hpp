/// A lab in virtual time: the dispatcher, a model of the nodes and of the driver around it, and a seed that decides what
/// goes wrong. It knows what links and nodes do to messages, and nothing of light: work is an amount.
///
/// What may happen until `calm_at`: nodes join late, crash and come back, hang, are slow, are cut off, run out of memory;
/// the operator drains, kicks, cancels and retries; the controller restarts from its journal. Afterwards all is mended,
/// and every job has to end.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "core/base/random.hpp"
#include "core/cluster/dispatcher.hpp"
#include "core/tracing/balancer.hpp"
#include "sim/event_queue.hpp"
#include "sim/lab_oracle.hpp"

namespace lichthof::sim {

/// The only thing that goes wrong in a lab of eight equal nodes with one job.
struct OneFault {
  Instant at;
  double pace = 1;  ///< of the first node from then on
  Duration hangs;   ///< or it does nothing for so long
};

struct LabRunOptions {
  std::uint64_t seed = 1;
  bool with_faults = true;
  std::optional<OneFault> only;
  std::optional<JobWish> wish;  ///< with `only`: the job
  Instant calm_at{40'000'000'000};
  Instant give_up_at{4'000'000'000'000};  ///< a job that has not ended by then never will
};

struct LabReport {
  std::string broken;  ///< what the oracle saw, and when; empty: nothing
  Instant end;
  std::uint64_t events = 0, jobs = 0, done = 0, failed = 0, cancelled = 0;
  std::uint64_t restarts = 0, drops = 0, hostings = 0, resumed = 0, joined_pictures = 0, drained = 0, moves = 0;
  std::uint64_t second_runs = 0, late_hostings = 0, late_checkpoints = 0;
};

class LabRun {
 public:
  explicit LabRun(const LabRunOptions& options);
  /// Until every job has ended, something is broken, or it is time to give up.
  LabReport run();

 private:
  /// Number of a connection between a node and the controller; never used again. 0: none.
  using Link = std::uint64_t;
  enum class Kind : std::uint8_t {
    join,
    report,
    hosted,
    host_failed,
    cells_done,
    checkpoint_part,
    column_done,  // to the controller
    host,
    begin,
    release,
    checkpoint,
    column,  // to a node
  };
  struct Message {
    Kind kind = Kind::report;
    JobId job;
    Epoch epoch;
    Pass pass = Pass::radiosity;
    std::uint64_t bytes = 0;
    ColumnJob columns{};
    std::map<CellId, double> rest{};  ///< work left, per cell
    double pace = 1;
  };

  // clang-format off
  struct ToController { std::uint32_t slot; Link link; Message message; };
  struct ToNode { std::uint32_t slot; Link link; Message message; };
  struct LinkLostByController { std::uint32_t slot; Link link; };
  struct LinkLostByNode { std::uint32_t slot; Link link; };
  struct Connect { std::uint32_t slot; std::uint64_t life; };
  struct Report { std::uint32_t slot; Link link; };
  struct Ready { std::uint32_t slot; Link link; JobId job; Epoch epoch; bool fails; };
  struct Worked { std::uint32_t slot; Link link; JobId job; Epoch epoch; std::optional<ColumnJob> columns; Instant since; };
  struct Boot { std::uint32_t slot; };
  struct Resume { std::uint32_t slot; };
  struct Fault {};
  struct Slow { std::uint32_t slot; double pace; Duration hangs; };
  struct Calm {};
  struct Submit { JobWish wish; };
  struct ControllerUp {};
  struct Wake {};
  // clang-format on
  using Event = std::variant<ToController, ToNode, LinkLostByController, LinkLostByNode, Connect, Report, Ready, Worked,
                             Boot, Resume, Fault, Slow, Calm, Submit, ControllerUp, Wake>;

  struct Node : ModelNode {
    NodeFacts facts;
    std::uint64_t life = 0;  ///< grows with every crash
    Instant hung_until, cut_off_until;
    double pace = 1;          ///< below 1: slow
    Instant last_arrival[2];  ///< from it, to it: links keep the order
    double speed() const { return facts.cores * facts.rays_per_s * pace; }
  };
  /// What the driver of a real lab keeps for a run: the balancer, and a stand-in for termination.
  struct DriverRun {
    Epoch epoch;
    Pass pass = Pass::radiosity;
    bool begun = false;
    std::set<std::uint32_t> hosts, ready, done;
    std::map<CellId, double> checkpoint;
    std::set<std::uint32_t> checkpoint_parts;
    std::optional<Balancer> balancer;  ///< of a picture; a node is one worker
  };

  // lab_run.cpp: the controller's side
  void draw_lab();
  void draw_equal_lab();
  void handle(ToController& event);
  void handle(LinkLostByController& event);
  void handle(Submit& event);
  void handle(ControllerUp&);
  void handle(Wake&) { wake_is_due_.reset(); }
  void lead();
  void carry_out(const Order& order);
  void carry_out_hosting(const HostRun& order);
  void tell_balancer(JobId job, DriverRun& run, lichthof::Message message);
  void check_failure(const JobEnded& ended);
  void forget(std::uint32_t slot);
  void forget_share(JobId job, DriverRun& run, std::uint32_t slot);
  void send_to_node(std::uint32_t slot, Message message);
  bool is_over() const;
  // lab_run_nodes.cpp: the nodes' side, and what goes wrong
  void handle(ToNode& event);
  void handle(LinkLostByNode& event);
  void handle(Connect& event);
  void handle(Report& event);
  void handle(Ready& event);
  void handle(Worked& event);
  void handle(Boot& event);
  void handle(Resume& event);
  void handle(Fault&);
  void handle(Slow& event);
  void set_pace(std::uint32_t slot, double pace);
  void go_on(std::uint32_t slot, JobId job, Epoch epoch, ModelShare& share);
  void handle(Calm&);
  void node_fault(std::uint32_t slot);
  void operator_acts();
  void end_draining();
  void crash(std::uint32_t slot, Duration away);
  void restart_controller();
  void send_to_controller(std::uint32_t slot, Message message);
  Instant arrival(std::uint32_t slot, bool to_node);
  bool postponed(Event& event);

  Duration drawn(double least_s, double most_s) {
    return {static_cast<std::int64_t>((least_s + (most_s - least_s) * random_.unit()) * 1e9)};
  }
  static std::uint32_t slot_of(NodeId node) { return node.value - 1; }
  static NodeId node_of(std::uint32_t slot) { return {slot + 1}; }

  LabRunOptions options_;
  Random random_;
  EventQueue<Event> events_;
  std::vector<Node> nodes_;
  std::map<std::uint32_t, std::deque<Event>> backlogs_;  ///< of nodes that hang
  Dispatcher dispatcher_;
  bool controller_is_up_ = true;
  std::vector<JournalEntry> journal_;                      ///< on the controller's disk
  std::map<JobId, std::map<CellId, double>> checkpoints_;  ///< likewise
  std::map<JobId, DriverRun> runs_;
  std::vector<Link> links_;  ///< of each slot, as the controller knows them
  Link last_link_ = 0, oldest_valid_link_ = 1;
  std::optional<Instant> wake_is_due_;
  std::uint32_t submissions_left_ = 0;
  bool is_calm_ = false;
  LabOracle oracle_;
  LabReport report_;
};

}  // namespace lichthof::sim
