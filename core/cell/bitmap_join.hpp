/// Shots that wait for the bitmaps of all their predecessors, and the OR that joins them (§2, Fig. 3 and 4).
///
/// A cell may not project before every path to it has reported: cell 2 of Fig. 3 waits for cells 1 and 4. At most two
/// bitmaps meet in 2-D, three in 3-D. The mark *closed* from one predecessor settles the whole join, because all
/// predecessors judge the same thing: whether any free pixel can still reach this cell or one behind it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "core/cell/routing.hpp"
#include "core/protocol/events.hpp"
#include "core/protocol/messages.hpp"

namespace lichthof {

/// A foreign shot that is ready to be received: the external shooting patch with its joined bitmap.
struct ExternalShot {
  std::shared_ptr<const Shot> shot;
  HemicubeBitmap bitmap;    ///< what nearer cells cover; meaningless when closed
  bool closed = false;      ///< nothing of it can reach this cell or any behind
  std::uint32_t parts = 0;  ///< messages joined: 1..3
  double power_w = 0;       ///< |power| that leaves with the shot, summed over channels: its rank among shooters
  std::size_t memory_bytes() const;
};

class BitmapJoin {
 public:
  BitmapJoin(CellId cell, std::uint32_t hemicube_resolution) : cell_(cell), resolution_(hemicube_resolution) {}

  enum class Filed { waiting, complete, refused };
  /// Files one part. On `complete` the joined shot stands in take().
  /// Refused, and without effect: a shot that is implausible or not for this cell, a sender that is no predecessor or has
  /// already sent its part, a bitmap of another resolution, a copy of the shot that differs from the first one.
  /// @cost the first part unpacks; joining is one pass over 3R² bits
  Filed file(const CellGrid& grid, const HemicubeMessage& message);

  /// What could not be about the shot of the last file(), where it was the shot's fault.
  const ShotFault& fault() const { return fault_; }

  /// The shot completed by the last file(). @pre it returned complete
  ExternalShot take();

  std::size_t waiting_shots() const { return waiting_.size(); }
  /// Parts of shots that still wait for others: received, not processed.
  std::uint64_t waiting_parts() const;
  std::size_t memory_bytes() const;

  struct Waiting {
    ExternalShot joined;
    CellList from;      ///< predecessors that have sent
    CellList expected;  ///< all predecessors
  };
  const std::map<ShotId, Waiting>& waiting() const { return waiting_; }

 private:
  bool is_done(ShotId id) const;
  void mark_done(ShotId id);

  CellId cell_;
  ShotFault fault_;
  std::uint32_t resolution_;
  std::map<ShotId, Waiting> waiting_;
  std::optional<ExternalShot> complete_;
  /// Shots that have been completed, one bit each in pages of 512 sequence numbers: a late duplicate must not start anew.
  std::map<std::pair<CellId, std::uint64_t>, std::array<std::uint64_t, 8>> done_;
};

}  // namespace lichthof
