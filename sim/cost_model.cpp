#include "sim/cost_model.hpp"

#include "core/base/check.hpp"

namespace lichthof::sim {

Duration CostModel::duration(const WorkDone& work, double speed) const {
  MUST(speed > 0);
  const double ns = step_ns + ray_ns * static_cast<double>(work.rays) +
                    cluster_ns * static_cast<double>(work.clusters_tested) +
                    bitmap_ns * static_cast<double>(work.bitmaps_projected) +
                    pixel_ns * static_cast<double>(work.pixels_traced) + byte_ns * static_cast<double>(work.bytes_sent);
  return {static_cast<std::int64_t>(ns / speed)};
}

}  // namespace lichthof::sim
