#include "apps/common/log.hpp"

#include <spdlog/spdlog.h>

namespace lichthof::apps {

void log_as_asked(const OutputOptions& options) {
  spdlog::set_level(options.quiet ? spdlog::level::err : options.verbose ? spdlog::level::info : spdlog::level::warn);
}

}  // namespace lichthof::apps
