#include "actors/cluster/kept_light.hpp"

#include "core/light/balance.hpp"
#include "core/light/cell_values.hpp"
#include "core/light/expected_light.hpp"
#include "core/scene/partition.hpp"

namespace lichthof::actors {

namespace {

Status kept(KeptLight& light, const std::optional<std::string>& base, const std::map<CellId, CellImage>& images,
            const LeadOptions& options, BlobCache& blobs) {
  if (!base) return Error{ErrorCode::io, "light", "what the pass began with is gone"};
  Expected<Solution> solution = options.read_solution(*base);
  if (!solution) return solution.error();
  if (Status put = put_images(*solution, images); !put) return put;
  solution->converged = light.is_end;
  const Parallel parallel(options.threads);
  set_pending(*solution, GroupExchange(*solution->scene, *solution->mesh, parallel));
  if (light.is_end) balance(*solution, parallel);
  const std::string path =
      options.folder + "/light." + std::to_string(light.job.value) + "." + std::to_string(light.sequence);
  if (Status written = options.write_solution(path, *solution); !written) return written;
  Expected<std::string> hash = blobs.adopt(path);
  if (!hash) return hash.error();
  light.hash = *hash, light.energy = solution->energy, light.counters = solution->counters;
  return Done{};
}

}  // namespace

void keep_light(KeptLight& light, const std::optional<std::string>& base, const std::map<CellId, CellImage>& images,
                const LeadOptions& options, BlobCache& blobs) {
  try {
    if (const Status status = kept(light, base, images, options, blobs); !status) light.reason = status.error().text();
  } catch (const std::exception& error) {
    light.reason = error.what();
  }
}

Status put_images(Solution& solution, const std::map<CellId, CellImage>& images) {
  CellsWanted wanted;
  wanted.along = solution.options.cells;
  const Expected<CellGrid> grid = partition(*solution.mesh, bounds(*solution.scene), wanted);
  if (!grid) return grid.error();
  const std::vector<std::vector<GroupId>> groups = groups_by_cell(*solution.mesh, *grid);
  if (images.size() != groups.size()) return Error{ErrorCode::bad_input, "cells", "are not all here"};
  EnergyLedger energy;
  for (const auto& [cell, image] : images) {
    if (Status set = set_cell_values(solution, groups.at(cell.value), image.light); !set) return set;
    energy.emitted += sum_channels(image.power.emitted);
    energy.absorbed += sum_channels(image.power.absorbed);
    energy.unshot += sum_channels(image.power.unshot);
    solution.counters += image.counters;
  }
  energy.escaped = solution.energy.escaped;
  energy.mirrored = solution.energy.mirrored, energy.mirrored_direct = solution.energy.mirrored_direct;
  energy.absorbed -= energy.mirrored;
  solution.energy = energy;
  return Done{};
}

}  // namespace lichthof::actors
