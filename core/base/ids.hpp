/// Strong, ordered identifiers: an index of one domain never passes for an index of another.
#pragma once

#include <compare>
#include <cstdint>

namespace lichthof {

template <class Tag, class Value = std::uint32_t>
struct Id {
  Value value = 0;
  auto operator<=>(const Id&) const = default;
};

using SurfaceId = Id<struct SurfaceTag>;    ///< index into Scene::surfaces
using PlaneId = Id<struct PlaneTag>;        ///< index into Mesh::planes
using GroupId = Id<struct GroupTag>;        ///< index into Mesh::groups
using PatchId = Id<struct PatchTag>;        ///< index into Mesh::patches
using ElementId = Id<struct ElementTag>;    ///< index into Mesh::elements
using CellId = Id<struct CellTag>;          ///< linear index into a CellGrid
using WorkerId = Id<struct WorkerTag>;      ///< a worker of the second pass
using NodeId = Id<struct NodeTag>;          ///< a daemon process hosting machines
using SceneVersion = Id<struct VersionTag, std::uint64_t>;  ///< number the controller gives a scene change
using JobId = Id<struct JobTag, std::uint64_t>;             ///< what a user submitted to a lab, for good
using Epoch = Id<struct EpochTag>;          ///< generation of a run; messages of older ones are dropped

/// One distribution of unshot radiosity: who shot, and the how-manieth shot of that cell it was.
struct ShotId {
  CellId cell;
  std::uint64_t sequence = 0;
  auto operator<=>(const ShotId&) const = default;
};

}  // namespace lichthof
