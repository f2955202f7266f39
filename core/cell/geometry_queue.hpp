/// Scene changes in the order of their versions (§2.1: "every processor has a local geometry-queue ... the queues contain
/// the history of all the geometry changes which, when executed in order, will describe the up-to-date scene").
#pragma once

#include <map>
#include <vector>

#include "core/protocol/messages.hpp"

namespace lichthof {

class GeometryQueue {
 public:
  /// Files a change that may arrive before its predecessors. @returns false for one that is known already or lies
  /// implausibly far ahead (the controller never has that many under way)
  bool file(const GeometryChange& change);

  /// True when the change that follows version() has arrived.
  bool has_next() const;
  /// Takes it: version() is one higher afterwards, the history one longer. @pre has_next()
  const GeometryChange& take_next();

  /// Scene version this cell has reached; 0 is the scene as loaded.
  SceneVersion version() const { return {history_.size()}; }
  /// All changes applied so far, in order: version v stands at index v - 1. Replayed, they rebuild the cell's scene.
  const std::vector<GeometryChange>& history() const { return history_; }
  std::size_t waiting() const { return waiting_.size(); }

 private:
  std::map<SceneVersion, GeometryChange> waiting_;
  std::vector<GeometryChange> history_;
};

}  // namespace lichthof
