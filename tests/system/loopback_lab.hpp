/// A controller and nodes as processes on loopback, on ports of their own, for tests of what surrounds a lab.
#pragma once

#include <doctest/doctest.h>
#include <signal.h>

#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/program.hpp"

namespace lichthof::testing {

class LoopbackLab {
 public:
  using Words = std::vector<std::string>;

  explicit LoopbackLab(const Words& options = {}, const std::string& host = "127.0.0.1") : host_(host) {
    Surroundings around;
    around.stdout_to = folder_ / "ports";
    Words words{"controller", "--listen",        host,           "--port", "0",     "--node-port", "0",
                "--state",    folder_ / "state", "--checkpoint", "0.3",    "--json"};
    words.insert(words.end(), options.begin(), options.end());
    controller_ = std::make_unique<Process>(words, around);
    REQUIRE(until([&] { return contents(around.stdout_to).find('}') != std::string::npos; }));
    const nlohmann::json ports = nlohmann::json::parse(contents(around.stdout_to));
    people_ = ports["people"], nodes_port_ = ports["nodes"];
  }

  std::uint16_t people() const { return people_; }
  std::uint16_t nodes_port() const { return nodes_port_; }
  std::string cluster() const { return host_ + ":" + std::to_string(people_); }
  Process& controller() { return *controller_; }
  Process& start(const std::string& name, const Words& options = {}) {
    Words words{"node",   "--join",  host_ + ":" + std::to_string(nodes_port_),
                "--name", name,      "--threads",
                "1",      "--cache", folder_ / "cache"};
    words.insert(words.end(), options.begin(), options.end());
    nodes_[name] = std::make_unique<Process>(words);
    return *nodes_[name];
  }
  Process& node(const std::string& name) { return *nodes_.at(name); }

  nlohmann::json asked(Words words) {
    words.insert(words.end(), {"--cluster", cluster(), "--json"});
    const nlohmann::json answer = nlohmann::json::parse(ran(words).out, nullptr, false);
    return answer.is_object() ? answer : nlohmann::json::object();
  }
  std::size_t node_count() { return asked({"shell", "-c", "nodes"}).value("nodes", nlohmann::json::array()).size(); }
  /// A picture of two rooms, whose light takes some seconds, and longer with more elements. @returns its id
  std::string submit(int elements = 40000) {
    const nlohmann::json answer =
        asked({"submit", std::string(LICHTHOF_SOURCE_DIR) + "/scenes/two_rooms.toml", "--cells", "2", "--eps", "1e-5",
               "--elements", std::to_string(elements), "--size", "48x36"});
    REQUIRE(answer.contains("id"));
    return answer["id"].dump();
  }
  nlohmann::json job(const std::string& id) { return asked({"jobs", id}).value("job", nlohmann::json::object()); }

  /// Waits for a condition, at most two minutes: for a busy machine; nothing takes so long unless it is broken.
  template <class Condition>
  static bool until(Condition condition) {
    using Clock = std::chrono::steady_clock;
    for (const auto end = Clock::now() + std::chrono::minutes(2); Clock::now() < end;) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
    return false;
  }

 private:
  Folder folder_;
  std::string host_;
  std::unique_ptr<Process> controller_;
  std::map<std::string, std::unique_ptr<Process>> nodes_;
  std::uint16_t people_ = 0, nodes_port_ = 0;
};

}  // namespace lichthof::testing
