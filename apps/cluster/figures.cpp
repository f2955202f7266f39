#include "apps/cluster/figures.hpp"

#include <prometheus/text_serializer.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "apps/cluster/lab_service.hpp"
#include "apps/cluster/machine_facts.hpp"

namespace lichthof::apps {

namespace {

constexpr std::size_t most_series = 4096;  // without keys whoever joins chooses his name, and may choose many

double cpu_seconds() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace

void raise(prometheus::Counter& counter, double to) { counter.Increment(std::max(0.0, to - counter.Value())); }

// ---- A process --------------------------------------------------------------------------------------------------------

ProcessFigures::ProcessFigures(const std::string& version)
    : cpu_(counter("process_cpu_seconds_total", "processor time used")),
      memory_(gauge("process_resident_memory_bytes", "memory that the process occupies")) {
  gauges("lichthof_build_info", "1; the program's version is a label").Add({{"version", version}}).Set(1);
  gauge("process_start_time_seconds", "when it began, since 1970").Set(static_cast<double>(std::time(nullptr)));
}

prometheus::Family<prometheus::Gauge>& ProcessFigures::gauges(const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry_);
}
prometheus::Family<prometheus::Counter>& ProcessFigures::counters(const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry_);
}
prometheus::Gauge& ProcessFigures::gauge(const char* name, const char* help) { return gauges(name, help).Add({}); }
prometheus::Counter& ProcessFigures::counter(const char* name, const char* help) {
  return counters(name, help).Add({});
}

std::string ProcessFigures::text() {
  raise(cpu_, cpu_seconds());
  memory_.Set(static_cast<double>(used_memory_bytes()));
  return prometheus::TextSerializer().Serialize(registry_.Collect());
}

// ---- A lab ------------------------------------------------------------------------------------------------------------

LabFigures::LabFigures(const std::string& version)
    : process_(version), nodes_(process_.gauges("lichthof_lab_nodes", "nodes that have joined, by state")),
      jobs_(process_.gauges("lichthof_lab_jobs", "jobs known, by state")) {
  const auto of_nodes = [&](const char* name, const char* help, const char* key) {
    of_nodes_.push_back({process_.gauges(name, help), "node", key, {}});
  };
  of_nodes("lichthof_lab_node_busy_ratio", "share of its cores that the node's process uses", "busy_share");
  of_nodes("lichthof_lab_node_cores", "cores that the node offers", "cores");
  of_nodes("lichthof_lab_node_memory_bytes", "memory that the node offers", "memory_bytes");
  of_nodes("lichthof_lab_node_free_memory_bytes", "memory that is free on its machine", "free_memory_bytes");
  of_nodes("lichthof_lab_node_silent_seconds", "since it was last heard", "seen_s");
  const auto of_jobs = [&](const char* name, const char* help, const char* key) {
    of_jobs_.push_back({process_.gauges(name, help), "job", key, {}});
  };
  of_jobs("lichthof_lab_job_progress_ratio", "of all passes, of jobs that have not ended", "progress");
  of_jobs("lichthof_lab_job_unshot_watts", "power still to be shot, of jobs that have not ended", "unshot_w");
  const auto counted = [&](const char* name, const char* help, const char* key) {
    counted_.push_back({process_.counters(name, help), key, {}, {}});
  };
  counted("lichthof_lab_node_shots_total", "shots that its cells have fired", "shots");
  counted("lichthof_lab_node_rays_total", "rays that its cells and workers have answered", "rays");
  counted("lichthof_lab_node_received_bytes_total", "bytes from the node to the controller", "bytes_in");
  counted("lichthof_lab_node_sent_bytes_total", "bytes from the controller to the node", "bytes_out");
  look(nlohmann::json::array(), nlohmann::json::array());
}

void LabFigures::Shown::show(const std::map<std::string, double>& values) {
  std::erase_if(series, [&](const auto& one) {
    const bool is_gone = !values.count(one.first);
    if (is_gone) family.Remove(one.second);
    return is_gone;
  });
  for (const auto& [name, value] : values) {
    prometheus::Gauge*& gauge = series[name];
    if (!gauge) gauge = &family.Add({{label, name}});
    gauge->Set(value);
  }
}

void LabFigures::Counted::count(const nlohmann::json& nodes) {
  std::map<std::uint64_t, double> now;
  for (const auto& node : nodes) {
    const std::uint64_t id = node["id"];
    const std::string name = node["name"];
    const double before = seen.count(id) ? seen[id] : 0, value = std::max(before, node.value(key, 0.0));
    now[id] = value;
    if (series.size() >= most_series && !series.count(name)) continue;
    prometheus::Counter*& counter = series[name];
    if (!counter) counter = &family.Add({{"node", name}});
    counter->Increment(value - before);
  }
  seen = std::move(now);
}

void LabFigures::look(const nlohmann::json& nodes, const nlohmann::json& jobs) {
  const std::lock_guard lock(mutex_);
  const auto by_state = [](prometheus::Family<prometheus::Gauge>& family, const nlohmann::json& all,
                           std::initializer_list<const char*> states) {
    for (const char* state : states) {
      const auto are = std::count_if(all.begin(), all.end(), [&](const auto& one) { return one["state"] == state; });
      family.Add({{"state", state}}).Set(static_cast<double>(are));
    }
  };
  by_state(nodes_, nodes, {"idle", "busy", "draining"});
  by_state(jobs_, jobs, {"queued", "running", "done", "failed", "cancelled"});
  for (Shown& figure : of_nodes_) {
    std::map<std::string, double> values;
    for (const auto& node : nodes) values[node["name"]] = node.value(figure.key, 0.0);
    figure.show(values);
  }
  for (Shown& figure : of_jobs_) {
    std::map<std::string, double> values;
    for (const auto& job : jobs)
      if (!is_over(job["state"])) values[job["id"].dump()] = job.value(figure.key, 0.0);
    figure.show(values);
  }
  for (Counted& figure : counted_) figure.count(nodes);
}

std::string LabFigures::text() {
  const std::lock_guard lock(mutex_);
  return process_.text();
}

// ---- A node -----------------------------------------------------------------------------------------------------------

NodeFigures::NodeFigures(const std::string& version, std::shared_ptr<const actors::NodeCounters> counters)
    : counted_(std::move(counters)), process_(version),
      connected_(process_.gauge("lichthof_node_connected", "1 while it has joined its controller")),
      working_(process_.gauge("lichthof_node_working", "0 while its owner is at the machine")),
      cores_(process_.gauge("lichthof_node_cores", "cores of the machine")),
      free_memory_(process_.gauge("lichthof_node_free_memory_bytes", "memory that is free on the machine")),
      shares_(process_.gauge("lichthof_node_shares", "passes of jobs that it has a share in")),
      cells_(process_.gauge("lichthof_node_cells", "cells that it hosts")),
      workers_(process_.gauge("lichthof_node_workers", "ray workers that it hosts")),
      shots_(process_.counter("lichthof_node_shots_total", "shots that its cells have fired")),
      rays_(process_.counter("lichthof_node_rays_total", "rays that its cells and workers have answered")),
      in_(process_.counter("lichthof_node_received_bytes_total", "bytes from controller and other nodes")),
      out_(process_.counter("lichthof_node_sent_bytes_total", "bytes to controller and other nodes")),
      yields_(process_.counter("lichthof_node_yields_total", "times that it left work because its owner came back")) {
  cores_.Set(std::max(1u, std::thread::hardware_concurrency()));
}

std::string NodeFigures::text() {
  const std::lock_guard lock(mutex_);
  connected_.Set(counted_->connected);
  working_.Set(counted_->working);
  free_memory_.Set(static_cast<double>(free_memory_bytes()));
  shares_.Set(counted_->shares), cells_.Set(counted_->cells), workers_.Set(counted_->workers);
  raise(shots_, static_cast<double>(counted_->shots));
  raise(rays_, static_cast<double>(counted_->rays));
  raise(in_, static_cast<double>(counted_->bytes_in));
  raise(out_, static_cast<double>(counted_->bytes_out));
  raise(yields_, static_cast<double>(counted_->yields));
  return process_.text();
}

}  // namespace lichthof::apps
