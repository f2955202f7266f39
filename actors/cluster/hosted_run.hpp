/// The share of a run that one node hosts: its cells, or its ray workers, as actors. What they say to machines elsewhere goes
/// through small actors that stand for those; what arrives for them from outside is handed in by deliver().
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "actors/cell_actor.hpp"
#include "actors/cluster/cluster_messages.hpp"
#include "actors/company.hpp"
#include "core/base/parallel.hpp"
#include "core/light/solution.hpp"
#include "core/scene/partition.hpp"
#include "core/tracing/picture_source.hpp"

namespace lichthof::actors {

/// Made on a thread of its own, since building trees takes seconds; started and used by the node's actor.
class HostedRun {
 public:
  /// How a machine here reaches one elsewhere; called from many threads. @returns bytes of the frame
  using Send = std::function<std::size_t(const Address& to, const Message& message)>;

  /// @param solution  what to begin with, or what to render
  /// @error  bad_input: cells or pictures that can't be
  static Expected<std::shared_ptr<HostedRun>> make(const HostShare& share, NodeId own,
                                                   std::shared_ptr<const Solution> solution, unsigned threads);
  ~HostedRun();

  const HostShare& share() const { return share_; }
  /// Nodes that host neighbours of cells here: they must be reachable.
  const std::vector<NodeId>& partners() const { return partners_; }

  void start(caf::actor_system& system, Send send);
  /// Those whose failure is the run's: cells or workers.
  std::vector<caf::actor> actors() const;
  /// @param frame_bytes  that it came in
  /// @returns false for a message that nobody here takes
  bool deliver(const RunMessage& message, Message content, std::size_t frame_bytes);
  /// Calls `take` with the image of each cell, on the cells' threads.
  void collect(const std::function<void(CellImage)>& take) const;
  /// While the way out is full no cell shoots.
  void hold(bool is_held);
  /// Hemicube messages that a cell has dealt with so far.
  std::uint64_t processed(CellId cell) const;
  /// Sums over its actors so far.
  struct Worked {
    std::uint64_t busy_ns = 0, cpu_ns = 0;  ///< in handlers; of it, with a core
    std::uint64_t shots = 0, rays = 0;      ///< of its cells
  };
  Worked worked() const;
  /// Of every actor, by name. Cells are asked to look at themselves on the way: what they say comes with the next call.
  std::vector<ActorLoad> load();

 private:
  /// Across the process's edge (bytes of frames).
  struct Traffic {
    std::atomic<std::uint64_t> bytes_in{0}, bytes_out{0};
  };
  struct HostedCell {
    std::shared_ptr<CellLight> light;
    std::shared_ptr<Cell> machine;
    CellActor actor;
    std::atomic<std::uint64_t> processed{0}, shots{0}, rays{0};
    // What it said of itself when it was asked last.
    std::atomic<bool> is_asked{false};
    std::atomic<const char*> state{"resting"};
    std::atomic<std::uint64_t> memory_bytes{0};
    std::atomic<double> unshot_w{0};
  };
  HostedRun(const HostShare& share, std::shared_ptr<const Solution> solution)
      : share_(share), solution_(std::move(solution)) {}
  Status make_cells(NodeId own, unsigned threads);
  Status make_source();
  void start_cells(caf::actor_system& system);
  void start_workers(caf::actor_system& system);
  CellImage image(const Cell& cell) const;
  void send(const Address& from, const Address& to, const Message& message);
  void ask_for_load(HostedCell& cell);
  static void look(const Cell& machine, bool is_held, HostedCell& cell);

  HostShare share_;
  std::shared_ptr<const Solution> solution_;
  std::vector<NodeId> partners_;
  std::shared_ptr<const CellGrid> grid_;
  std::vector<std::vector<GroupId>> groups_;
  std::map<CellId, std::unique_ptr<HostedCell>> cells_;
  std::shared_ptr<const ColumnSource> source_;
  Send send_;
  std::unique_ptr<Company> company_;
  std::shared_ptr<Meters> meters_ = std::make_shared<Meters>();
  std::shared_ptr<std::atomic<bool>> hold_ = std::make_shared<std::atomic<bool>>(false);
  std::map<WorkerId, JobSink> workers_;
  std::map<Address, Traffic> traffic_;  ///< of everybody here; complete before anybody speaks
};

}  // namespace lichthof::actors
