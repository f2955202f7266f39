#include "actors/system_config.hpp"

#include <caf/io/all.hpp>

#include "actors/wire.hpp"

namespace lichthof::actors {

SystemConfig::SystemConfig(const SystemOptions& options) {
  add_message_types<caf::id_block::lichthof>();
  set("scheduler.policy", caf::atom("sharing"));
  set("scheduler.max-threads", options.threads);
  set("scheduler.max-throughput", options.max_throughput);
  if (!options.network) return;
  load<caf::io::middleman>();
  set("middleman.workers", std::size_t{0});  // for CAF's own protocol, which nobody speaks
}

}  // namespace lichthof::actors
