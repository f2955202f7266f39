/// The light of a running job on the controller's disk: what a pass began with and the images of its cells become a solution file.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "actors/cluster/blob_cache.hpp"
#include "actors/cluster/cluster_messages.hpp"
#include "actors/cluster/lead.hpp"

namespace lichthof::actors {

/// What became of it.
struct KeptLight {
  JobId job;
  Epoch epoch;
  bool is_end = false;         ///< converged; otherwise a checkpoint
  std::uint64_t sequence = 0;  ///< of the writings of this lead: an older one never replaces a newer
  std::string hash;            ///< empty: see reason
  std::string reason;
  EnergyLedger energy;
  SolveCounters counters;
};

/// Fills in hash, energy and counters, or the reason. @cost reads and writes a whole solution: seconds
/// @param base  file of the light that the pass began with
void keep_light(KeptLight& light, const std::optional<std::string>& base, const std::map<CellId, CellImage>& images,
                const LeadOptions& options, BlobCache& blobs);

/// Puts images of all cells into a solution: light, pending light, energy without what escaped, counters added.
/// @error bad_input: an image that does not fit
Status put_images(Solution& solution, const std::map<CellId, CellImage>& images);

}  // namespace lichthof::actors
