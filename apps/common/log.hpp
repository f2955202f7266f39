/// How much the log says on stderr.
#pragma once

#include "apps/common/options.hpp"

namespace lichthof::apps {

/// Warnings, unless --quiet (errors only) or --verbose (facts as well) was given.
void log_as_asked(const OutputOptions& options);

}  // namespace lichthof::apps
