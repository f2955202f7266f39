/// What Prometheus reads of a controller and of a node: names, units and help of every figure, over prometheus-cpp. Counters
/// never fall while the process lives, whatever becomes of the nodes and connections they count.
///
///     lichthof_build_info  process_...     both
///     lichthof_lab_...                     the whole lab, as its controller sees it
///     lichthof_node_...                    one node, as it sees itself
#pragma once

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/registry.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "actors/cluster/node_counters.hpp"

namespace lichthof::apps {

inline constexpr const char* figures_type = "text/plain; version=0.0.4; charset=utf-8";

/// What every process tells. Not for several threads at once.
class ProcessFigures {
 public:
  explicit ProcessFigures(const std::string& version);
  /// All that is registered, in the text format of Prometheus.
  std::string text();

  prometheus::Gauge& gauge(const char* name, const char* help);
  prometheus::Counter& counter(const char* name, const char* help);
  prometheus::Family<prometheus::Gauge>& gauges(const char* name, const char* help);
  prometheus::Family<prometheus::Counter>& counters(const char* name, const char* help);

 private:
  prometheus::Registry registry_;
  prometheus::Counter& cpu_;
  prometheus::Gauge& memory_;
};

/// Raises a counter to what somebody else has counted; a smaller number changes nothing.
void raise(prometheus::Counter& counter, double to);

/// Of the lab. Any thread.
class LabFigures {
 public:
  explicit LabFigures(const std::string& version);
  /// Looks at what there is. What a node does after the last look before it goes is not counted: look once a second.
  /// @param nodes, jobs  as LabService gives them
  void look(const nlohmann::json& nodes, const nlohmann::json& jobs);
  std::string text();

 private:
  /// A figure of which every node or job that is there has one.
  struct Shown {
    prometheus::Family<prometheus::Gauge>& family;
    const char* label;
    const char* key;  ///< in its document
    std::map<std::string, prometheus::Gauge*> series;
    void show(const std::map<std::string, double>& values);
  };
  /// A count that stays when its node has gone.
  struct Counted {
    prometheus::Family<prometheus::Counter>& family;
    const char* key;
    std::map<std::string, prometheus::Counter*> series;
    std::map<std::uint64_t, double> seen;  ///< by the id of its stay: a node that comes again begins at 0
    void count(const nlohmann::json& nodes);
  };

  std::mutex mutex_;
  ProcessFigures process_;
  prometheus::Family<prometheus::Gauge>&nodes_, &jobs_;
  std::vector<Shown> of_nodes_, of_jobs_;
  std::vector<Counted> counted_;
};

/// Of a node. Any thread.
class NodeFigures {
 public:
  NodeFigures(const std::string& version, std::shared_ptr<const actors::NodeCounters> counters);
  std::string text();

 private:
  std::mutex mutex_;
  std::shared_ptr<const actors::NodeCounters> counted_;
  ProcessFigures process_;
  prometheus::Gauge &connected_, &working_, &cores_, &free_memory_, &shares_, &cells_, &workers_;
  prometheus::Counter &shots_, &rays_, &in_, &out_, &yields_;
};

}  // namespace lichthof::apps
