/// One pass of a job as its lead sees it: the machine that leads it, where its cells or workers are, and the images of cells that
/// come in for a checkpoint or at the end. It knows no socket: what is to be sent, it hands out.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "actors/cluster/cluster_messages.hpp"
#include "core/cluster/controller.hpp"
#include "core/tracing/balancer.hpp"

namespace lichthof::actors {

class RunLead {
 public:
  /// To the node that hosts a machine; control, or bulk.
  using Send = std::function<void(NodeId, const ClusterMessage&)>;
  enum class Wants : std::uint8_t {
    nothing,
    checkpoint,  ///< images of all cells are here: keep them; the pass goes on
    end,         ///< images of all cells are here, converged; or the picture is finished
  };

  RunLead(const HostRun& order, const PictureSpec& picture, double eps, Send send);

  JobId job() const { return order_.job; }
  Epoch epoch() const { return order_.epoch; }
  Pass pass() const { return order_.pass; }
  bool hosts(NodeId node) const;
  /// More nodes for a picture. @returns first worker and count per node, as HostShare names them
  std::map<NodeId, std::pair<std::uint32_t, std::uint32_t>> add_workers(const HostRun& order);
  void lose_workers(NodeId node, Instant now);

  /// Columns that were finished before: the picture begins without them.
  void restore(std::vector<ColumnResult> columns, Instant now);
  void begin(Instant now);
  void take_checkpoint(Instant now);
  /// What a node says in the name of machines that it does not host is ignored.
  void accept(NodeId from, const RunMessage& message, Message content, Instant now);
  void accept(NodeId from, CellImage image, Instant now);
  /// Asks cells for reports, for progress.
  void refresh(Instant now);
  /// What has become due; told once.
  Wants due();

  /// The images that have come in. After a checkpoint the pass goes on.
  std::map<CellId, CellImage> take_images(Instant now);
  RadiosityProgress radiosity() const { return controller_ ? controller_->progress() : RadiosityProgress{}; }
  std::vector<CellReport> cells() const;
  const Balancer* balancer() const { return balancer_.get(); }

 private:
  void drive(Instant now);
  void collect();

  HostRun order_;
  Send send_;
  std::unique_ptr<Controller> controller_;
  std::unique_ptr<Balancer> balancer_;
  std::vector<NodeId> nodes_of_cells_;
  std::map<WorkerId, NodeId> workers_;
  std::uint32_t next_worker_ = 0;
  bool begun_ = false;
  bool collecting_ = false, is_checkpoint_ = false, ended_ = false;
  std::map<CellId, CellImage> images_;
  Wants due_ = Wants::nothing;
};

}  // namespace lichthof::actors
