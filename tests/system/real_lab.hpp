/// A lab of real processes under test: a controller, nodes, jobs; on loopback, or every process on a host of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/lab_network.hpp"
#include "tests/system/program.hpp"

namespace lichthof::testing {

/// Seconds of a clock that nobody sets.
double now_s();

/// How long the trials are. In the gate they are short; LICHTHOF_TRIALS=long, or a list such as "kills=20,soak_s=3600", makes
/// them what the promises say.
struct Trials {
  std::uint32_t seed = 77;
  std::uint32_t kills = 1;     ///< moments for each number of nodes and each pass
  std::uint32_t hang_s = 9;    ///< a node stands still
  std::uint32_t restarts = 2;  ///< of a killed controller
  std::uint32_t stops = 2;     ///< under load
  std::uint32_t soak_s = 20;
  std::uint32_t elements = 6000;       ///< of the room: they take 2 s on four nodes
  std::uint32_t slow_elements = 6000;  ///< of the room with a slow node
  /// @returns what the environment asks for
  static const Trials& asked();
};

class RealLab {
 public:
  struct Setup {
    std::vector<std::string> nodes;
    double checkpoint_s = 0.3;
    bool has_hosts = false;  ///< the controller on host 0, the nodes on hosts of their own, with certificates
  };
  explicit RealLab(const Setup& setup);
  explicit RealLab(std::vector<std::string> nodes) : RealLab(Setup{std::move(nodes)}) {}

  /// With the ports and the state of the one before.
  void start_controller();
  void kill_controller();
  Process& controller() { return *controller_; }
  void start(const std::string& name);
  Process& node(const std::string& name) { return *nodes_.at(name); }
  void kill(const std::string& name);
  bool port_is_free(const std::string& port) const;
  bool ports_are_free() const { return port_is_free(people_) && port_is_free(nodes_port_); }
  std::string state(const std::string& file) const { return folder_ / ("state/" + file); }

  /// Absent where the machine does not permit one; then nodes that are cut off are stopped instead.
  LabNetwork* network() { return network_.get(); }
  std::size_t host(const std::string& name) const { return hosts_.at(name); }
  /// Cuts nodes off from the controller and from all others, or ends that.
  void cut(const std::vector<std::string>& names, bool is_cut);

  /// The answer to a command, which must be one JSON document; an empty one when there is none.
  nlohmann::json asked(std::vector<std::string> arguments);
  std::size_t node_count() { return asked({"shell", "-c", "nodes"}).value("nodes", nlohmann::json::array()).size(); }
  template <class Condition>
  bool until(Condition condition, double patience_s = 120) {  // nothing takes so long unless it is broken
    for (const double end = now_s() + patience_s; now_s() < end;) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
    return false;
  }

  std::string submit(const std::string& eps, std::uint32_t elements = Trials::asked().elements);
  /// The room in tiles, none of which is divided again: see write_tiled_room.
  std::string submit_tiles();
  nlohmann::json job(const std::string& id) { return asked({"jobs", id}).value("job", nlohmann::json::object()); }
  std::string job_state(const std::string& id) { return job(id).value("state", ""); }
  bool is_over(const std::string& id);
  bool is_in(const std::string& id, const std::string& pass) { return job(id).value("pass", "") == pass; }
  std::string log(const std::string& id);
  /// Writes the job's light so far or its picture to a file. @returns its name
  std::string fetched(const std::string& id, const std::string& ending);
  std::vector<float> picture(const std::string& id);
  /// Irradiance of all elements, channel by channel.
  std::vector<float> light(const std::string& id);
  /// The same second pass in one process, on the job's own light.
  std::vector<float> picture_here(const std::string& id);
  /// Waits for the job, which must end well: picture and ledger are looked at.
  void expect_done(const std::string& id);

 private:
  std::vector<std::string> keys(const std::string& name) const;
  Outcome ran_here(std::vector<std::string> arguments) const;

  Folder folder_;
  std::unique_ptr<LabNetwork> network_;
  std::map<std::string, std::size_t> hosts_;
  double checkpoint_s_ = 0;
  std::string address_ = "127.0.0.1", people_ = "0", nodes_port_ = "0";
  std::unique_ptr<Process> controller_;
  std::map<std::string, std::unique_ptr<Process>> nodes_;
};

/// Root mean square of the difference, relative to the mean of b.
double difference(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace lichthof::testing
