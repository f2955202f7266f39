/// A lab as small as can be: a controller and a node, as users start them, in the clear or with certificates.
#pragma once

#include <doctest/doctest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "actors/link/keys.hpp"
#include "actors/link/socket.hpp"
#include "tests/system/program.hpp"

namespace lichthof::testing {

/// For a busy machine; nothing takes so long unless it is broken.
constexpr auto small_lab_patience = std::chrono::seconds(60);

template <class Condition>
bool until(Condition condition) {
  for (const auto end = std::chrono::steady_clock::now() + small_lab_patience;
       std::chrono::steady_clock::now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

inline std::uint16_t free_port() {
  const auto socket = actors::listening_socket("127.0.0.1", 0);
  REQUIRE(socket);
  return actors::local_port(*socket);
}

/// A controller and a node as users start them.
class SmallLab {
 public:
  explicit SmallLab(bool has_keys = false) : has_keys_(has_keys) {
    if (has_keys) {
      REQUIRE(actors::create_authority(keys()));
      for (const auto& [name, role] :
           {std::pair{"lab", actors::Role::controller}, std::pair{"anna", actors::Role::node},
            std::pair{"bert", actors::Role::node}, std::pair{"me", actors::Role::user}})
        REQUIRE(actors::issue_certificate(keys(), {name, role}));
    }
    people = free_port(), nodes = free_port(), node = free_port();
    controller_ = started("lab", {"controller", "--port", std::to_string(people), "--node-port", std::to_string(nodes),
                                  "--state", folder / "state"});
    start_node("anna", node);
    REQUIRE(until([&] { return node_count() == 1; }));
  }
  void start_node(const std::string& name, std::uint16_t port) {
    nodes_.push_back(
        started(name, {"node", "--join", "127.0.0.1:" + std::to_string(nodes), "--port", std::to_string(port), "--name",
                       name, "--threads", "1", "--cache", folder / "cache"}));
  }

  Outcome asked(std::vector<std::string> words) {
    words.insert(words.end(), {"--cluster", "127.0.0.1:" + std::to_string(people), "--json"});
    add_keys(words, "me");
    return ran(words);
  }
  /// 0 also when nobody answers.
  std::size_t node_count() {
    const nlohmann::json answer = nlohmann::json::parse(asked({"shell", "-c", "nodes"}).out, nullptr, false);
    return answer.is_object() && answer.contains("nodes") ? answer["nodes"].size() : 0;
  }
  bool renders() {
    write_room(folder);
    const Outcome outcome = asked({"submit", folder / "room.toml", "-o", folder / "room.exr", "--elements", "1500",
                                   "--size", "32x24", "--eps", "1e-2"});
    INFO(outcome.err);
    return outcome.status == 0;
  }
  /// Of the controller and of the first node.
  std::vector<std::uint64_t> resident_bytes() const {
    std::vector<std::uint64_t> all;
    for (const Process* process : {controller_.get(), nodes_[0].get()}) {
      const std::string status = contents("/proc/" + std::to_string(process->id()) + "/status");
      const std::size_t at = status.find("VmRSS:");
      REQUIRE(at != std::string::npos);
      all.push_back(1024 * std::strtoull(status.c_str() + at + 6, nullptr, 10));
    }
    return all;
  }

  std::uint16_t people = 0, nodes = 0, node = 0;
  Folder folder;

 private:
  std::string keys() const { return folder / "keys"; }
  void add_keys(std::vector<std::string>& words, const std::string& name) const {
    if (!has_keys_) return;
    words.insert(words.end(), {"--authority", keys() + "/ca.crt", "--certificate", keys() + "/" + name + ".crt",
                               "--key", keys() + "/" + name + ".key"});
  }
  std::unique_ptr<Process> started(const std::string& name, std::vector<std::string> words) const {
    words.push_back("--quiet");
    add_keys(words, name);
    return std::make_unique<Process>(words);
  }

  bool has_keys_;
  std::unique_ptr<Process> controller_;
  std::vector<std::unique_ptr<Process>> nodes_;
};

}  // namespace lichthof::testing
