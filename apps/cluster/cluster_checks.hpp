/// Whether this machine can take part in a cluster, and how the cluster does as seen from here: the checks of
/// `lichthof doctor --cluster`, each a fact with a mend.
#pragma once

#include <vector>

#include "apps/cluster/cluster_options.hpp"
#include "apps/common/machine.hpp"

namespace lichthof::apps {

/// Names, certificates, ports, clocks, versions, addresses, nodes. What can't be asked because something before it is broken
/// is left out. @cost a second, or some more where nobody answers
std::vector<Finding> cluster_findings(const ClusterOptions& options);

}  // namespace lichthof::apps
