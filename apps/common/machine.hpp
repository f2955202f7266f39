/// What this machine is and what ails it: the checks of `lichthof doctor`, each a fact with a mend.
#pragma once

#include <string>
#include <vector>

namespace lichthof::apps {

enum class Health { good, poor, broken };  ///< poor: works, but slower or less than it could

struct Finding {
  std::string name;  ///< "cpu", "memory"
  Health health = Health::good;
  std::string detail;  ///< what was found
  std::string mend;    ///< what to do; empty when good
};

/// Processor, threads, memory, limits, temporary folder, libraries.
std::vector<Finding> machine_findings();

}  // namespace lichthof::apps
