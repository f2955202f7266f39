/// What the processes of a cluster say to each other, over the link: the lead (the controller's process) and its nodes, and the
/// nodes among themselves. A frame is one of these; machines' own messages (core/protocol) travel inside RunMessage.
///
///     node ──Registration──► lead ──Welcome──► node
///     lead ──HostShare──► node ──WantBlob──► lead ──BlobPart──► node ──Hosted──► lead
///     lead, cells, workers ◄──RunMessage──► each other; cells of different nodes talk directly
///     node ──Leaving──► lead, before the node closes the link by itself
///     lead ──CollectCells──► node ──CellImage──► lead;  lead ──ReleaseShare──► node
///
/// Every frame of a run names its epoch: what belongs to an older one is dropped.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/ids.hpp"
#include "core/cluster/lab.hpp"
#include "core/light/cell_light.hpp"
#include "core/light/solution.hpp"
#include "core/protocol/effects.hpp"

namespace lichthof::actors {

/// A node to its lead: here I am, and this is what I can do.
struct Registration {
  std::string name;
  std::uint32_t cores = 1;
  std::uint64_t memory_bytes = 0;
  double rays_per_s = 0;  ///< of one core
};
struct Welcome {
  NodeId node;
};

/// How a cell or a worker does. Counts grow as long as it lives; whoever shows rates takes differences.
struct ActorLoad {
  std::string name;  ///< "cell 3"
  JobId job;
  std::string state;          ///< cell: resting, idle, held, shooting; worker: waiting, tracing
  std::uint64_t busy_ns = 0;  ///< spent in its handlers
  std::uint64_t mailbox = 0;  ///< messages that wait there
  std::uint64_t shots = 0, rays = 0;
  std::uint64_t bytes_in = 0, bytes_out = 0;  ///< of frames that came from and went to other processes
  std::uint64_t memory_bytes = 0;             ///< cell: elements, trees, queues; worker: its share of what all share
  double unshot_w = 0;                        ///< summed over channels
};

/// How a node does; once a second.
struct NodeReport {
  double busy_share = 0;  ///< of its cores, of this process
  double pace = 1;          ///< share of a core that its actors got while they had work; @see core/cluster/pace
  std::uint64_t free_memory_bytes = 0, used_memory_bytes = 0;
  std::uint64_t at_ns = 0;  ///< by the node's own clock: rates are differences of two reports
  std::uint64_t shots = 0, rays = 0;  ///< since it joined
  std::vector<ActorLoad> actors;
};

struct Peer {
  NodeId node;
  std::string host;
  std::uint16_t port = 0;
  std::uint64_t boot_id = 0;
};

/// What a picture is of; plain numbers, so that every node makes the same of it.
struct PictureSpec {
  std::uint8_t method = 0;  ///< place in TracingMethod; 255: path tracing
  std::uint32_t width = 640, height = 480, samples = 4, gather_rays = 0;
  std::vector<double> camera;  ///< eye, target, up, field of view: 10 numbers
};

/// Make machines for a run: cells of the first pass, or workers of the second.
struct HostShare {
  JobId job;
  Epoch epoch;
  Pass pass = Pass::radiosity;
  std::string solution;       ///< hash of the blob to begin with: scene, mesh, options, light so far
  std::vector<NodeId> cells;  ///< who hosts which, by CellId
  std::vector<Peer> peers;    ///< all who host cells
  PictureSpec picture;
  std::uint32_t first_worker = 0, workers = 0;
  std::uint64_t bytes = 0;  ///< about as much memory will be needed
};
struct Hosted {
  JobId job;
  Epoch epoch;
};
struct HostFailed {
  JobId job;
  Epoch epoch;
  std::string reason;
  bool is_unreachable = false;  ///< another node is at fault, or the way to it
};
struct ReleaseShare {
  JobId job;
  Epoch epoch;
};

/// A message between machines. @see codec.hpp for the bytes
struct RunMessage {
  JobId job;
  Epoch epoch;
  std::uint8_t to_kind = 0;  ///< place in Address
  std::uint32_t to = 0;      ///< its number
  std::vector<std::uint8_t> message;
};
Address address(const RunMessage& message);
RunMessage run_message(JobId job, Epoch epoch, const Address& to, const Message& message);

/// Cells at rest: send what you have.
struct CollectCells {
  JobId job;
  Epoch epoch;
};
/// The light of one cell: H, direct H, S of its elements in the order of the mesh, and what the solution's sums are made of.
struct CellImage {
  JobId job;
  Epoch epoch;
  CellId cell;
  std::vector<float> light;  ///< 9 per element
  CellPower power;
  SolveCounters counters;
};

struct WantBlob {
  std::string hash;
  std::uint64_t offset = 0;
};
struct BlobPart {
  std::string hash;
  std::uint64_t offset = 0, total = 0;
  std::vector<std::uint8_t> bytes;
};
/// A node to its lead: I go, and it is no job's fault.
struct Leaving {
  std::string reason;
};
/// The lead is stopping, or has no use for the node; it may come again.
struct Dismissed {
  std::string reason;
};

using ClusterMessage = std::variant<Registration, Welcome, NodeReport, HostShare, Hosted, HostFailed, ReleaseShare,
                                    RunMessage, CollectCells, CellImage, WantBlob, BlobPart, Dismissed, Leaving>;

constexpr std::uint8_t cluster_wire_version = 4;
constexpr std::size_t blob_part_bytes = 1u << 20;

std::vector<std::uint8_t> encode(const ClusterMessage& message);
/// @error bad_input with what is wrong
Expected<ClusterMessage> decode_cluster(std::span<const std::uint8_t> bytes);

}  // namespace lichthof::actors
