/// `lichthof doctor --cluster` on labs that are well and labs that are not.
#include <httplib.h>
#include <sys/stat.h>

#include "actors/link/keys.hpp"
#include "actors/link/socket.hpp"
#include "tests/system/loopback_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

using Words = LoopbackLab::Words;

/// The findings of a name: "health: detail -> mend", one line each; empty when there are none.
std::string found(const Outcome& outcome, const std::string& name) {
  std::string lines;
  const nlohmann::json document = outcome.json();
  for (const auto& check : document["checks"])
    if (check["name"] == name)
      lines += check["health"].get<std::string>() + ": " + check["detail"].get<std::string>() + " -> " +
               check["mend"].get<std::string>() + "\n";
  return lines;
}
bool is(const Outcome& outcome, const std::string& name, const std::string& health, const std::string& part = "") {
  const std::string lines = found(outcome, name);
  const bool good = lines.starts_with(health + ":") && lines.find(part) != std::string::npos;
  if (!good) MESSAGE(name << " is: " << lines << " instead of " << health << " with: " << part);
  return good;
}

/// A lab's keys, and processes that use them.
class Keys {
 public:
  Keys() : path_(folder_ / "keys") {
    REQUIRE(actors::create_authority(path_));
    issue("lab", actors::Role::controller);
    issue("me", actors::Role::user);
  }
  void issue(const std::string& name, actors::Role role, const actors::Validity& validity = actors::issued_validity) {
    REQUIRE(actors::issue_certificate(path_, {name, role}, validity));
  }
  std::string operator/(const std::string& file) const { return path_ + "/" + file; }
  Words of(const std::string& name) const {
    return {"--authority", path_ + "/ca.crt",          "--certificate", path_ + "/" + name + ".crt",
            "--key",       path_ + "/" + name + ".key"};
  }

 private:
  Folder folder_;
  std::string path_;
};

Outcome doctor(const std::string& cluster, const Words& options = {}) {
  Words words{"doctor", "--json", "--cluster", cluster};
  words.insert(words.end(), options.begin(), options.end());
  return ran(words);
}

/// What a controller would answer whose clock, version and nodes are not ours to set.
class Elsewhere {
 public:
  Elsewhere() {
    server_.Get("/v1/lab", [this](const httplib::Request&, httplib::Response& response) {
      nlohmann::json lab = about;
      lab["time_s"] =
          offset_s + std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
      response.set_content(text.empty() ? lab.dump() : text, "application/json");
    });
    server_.Get("/v1/nodes", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(nodes.dump(), "application/json");
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ~Elsewhere() {
    server_.stop();
    thread_.join();
  }
  std::string cluster() const { return "127.0.0.1:" + std::to_string(port_); }

  nlohmann::json about = nlohmann::json::object(), nodes = nlohmann::json::array();
  double offset_s = 0;
  std::string text;

 private:
  httplib::Server server_;
  int port_ = 0;
  std::thread thread_;
};

/// A port that nobody listens at.
std::string dead_port() {
  const auto socket = actors::listening_socket("127.0.0.1", 0);
  REQUIRE(socket);
  return std::to_string(actors::local_port(*socket));
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("doctor: a lab in the clear on this machine is well") {
    LoopbackLab lab;
    const Outcome empty = doctor(lab.cluster());
    CHECK(is(empty, "nodes", "poor", "none has joined -> start some"));
    lab.start("anna");
    lab.start("bert");
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    const Outcome outcome = doctor(lab.cluster());
    CHECK(outcome.status == 0);
    CHECK(outcome.json()["good"] == true);
    CHECK(is(outcome, "host name", "ok"));
    CHECK(is(outcome, "address", "ok", "this machine"));
    CHECK(is(outcome, "certificate", "ok", "none is needed"));
    CHECK(is(outcome, "desk", "ok", std::to_string(lab.people())));
    CHECK(is(outcome, "port of nodes", "ok", std::to_string(lab.nodes_port())));
    CHECK(is(outcome, "clock", "ok", "give or take"));
    CHECK(is(outcome, "version", "ok"));
    CHECK(is(outcome, "nodes", "ok", "2 idle"));
    CHECK(found(outcome, "node anna").empty());

    lab.asked({"shell", "-c", "drain anna"});
    CHECK(is(doctor(lab.cluster()), "node anna", "poor", "drain anna off"));
    const Outcome lines = ran({"doctor", "--cluster", lab.cluster()});
    CHECK(lines.out.find("ok      clock") != std::string::npos);
    CHECK(lines.out.find("poor    node anna") != std::string::npos);
    // Without --cluster nobody is asked.
    CHECK(ran({"doctor"}).out.find("clock") == std::string::npos);
  }

  TEST_CASE("doctor: nobody there, no such host, no host at all") {
    const Outcome nobody = doctor("127.0.0.1:" + dead_port());
    CHECK(nobody.status == 1);
    CHECK(is(nobody, "desk", "broken", "no controller answers -> start one"));
    CHECK(found(nobody, "clock").empty());
    const Outcome unknown = doctor("no-such-host.invalid", {"--insecure"});
    CHECK(unknown.status == 1);
    CHECK(is(unknown, "address", "broken", "no-such-host.invalid"));
    CHECK(found(unknown, "desk").empty());
    CHECK(is(doctor("a b"), "cluster", "broken", "HOST:PORT"));
    CHECK(is(doctor("10.0.0.1"), "cluster", "broken", "certificates are needed"));
  }

  TEST_CASE("doctor: a controller with another clock, another version, and a closed port for nodes") {
    Elsewhere lab;
    lab.about = {{"version", "0.0.9"}, {"nodes_port", std::stoi(dead_port())}};
    lab.nodes = {{{"name", "anna"}, {"host", "10.0.0.7"}, {"state", "idle"}, {"seen_s", 0.3}, {"version", "0.0.9"}},
                 {{"name", "bert"}, {"host", "10.0.0.8"}, {"state", "busy"}, {"seen_s", 7.8}}};
    const auto asked_at = [&](double offset_s) {
      lab.offset_s = offset_s;
      return doctor(lab.cluster());
    };
    const Outcome late = asked_at(-100);
    CHECK(late.status == 1);
    CHECK(is(late, "desk", "ok"));
    CHECK(is(late, "clock", "poor", "behind"));
    CHECK(is(late, "version", "broken", "controller 0.0.9, here "));
    CHECK(is(late, "port of nodes", "broken", "refused -> open this port"));
    CHECK(is(late, "nodes", "ok", "1 busy, 1 idle"));
    CHECK(is(late, "node anna", "broken", "runs 0.0.9"));
    CHECK(is(late, "node bert", "poor", "silent for 8 s"));
    CHECK(is(asked_at(0), "clock", "ok"));
    CHECK(is(asked_at(7200), "clock", "broken", "ahead"));
  }

  TEST_CASE("doctor: something that answers, but is no controller") {
    Elsewhere lab;
    lab.text = "<html>";
    CHECK(is(doctor(lab.cluster()), "desk", "broken", "no JSON"));
  }

  TEST_CASE("doctor: certificates that are well, soon too old, too old, another's, open to all, of no lab") {
    Keys keys;
    LoopbackLab lab(keys.of("lab"));
    const auto asked_as = [&](const std::string& name) { return doctor(lab.cluster(), keys.of(name)); };
    const Outcome well = asked_as("me");
    CHECK(well.status == 0);
    CHECK(is(well, "certificate", "ok", "user me, valid to 20"));
    CHECK(is(well, "authority", "ok", "valid to 20"));
    CHECK(is(well, "desk", "ok"));
    CHECK(is(well, "clock", "ok"));

    keys.issue("old", actors::Role::user, {-100 * actors::day_s, 5 * actors::day_s});
    const Outcome soon = asked_as("old");
    CHECK(soon.status == 0);
    CHECK(is(soon, "certificate", "poor", "only 4 days -> issue a new pair"));
    CHECK(is(soon, "desk", "ok"));

    keys.issue("over", actors::Role::user, {-100 * actors::day_s, -1 * actors::day_s});
    const Outcome over = asked_as("over");
    CHECK(over.status == 1);
    CHECK(is(over, "certificate", "broken", "expired"));
    CHECK(found(over, "desk").empty());

    keys.issue("elsewhere", actors::Role::node);
    CHECK(is(asked_as("elsewhere"), "certificate", "poor", "node elsewhere, but this machine is "));

    keys.issue("open", actors::Role::user);
    REQUIRE(::chmod((keys / "open.key").c_str(), 0644) == 0);
    CHECK(is(asked_as("open"), "certificate", "broken", "-> run: chmod 600 "));

    Keys others;
    Words mixed = others.of("me");
    mixed[1] = keys / "ca.crt";
    CHECK(is(doctor(lab.cluster(), mixed), "certificate", "broken", "not valid under"));
    const Outcome stranger = doctor(lab.cluster(), others.of("me"));
    CHECK(stranger.status == 1);
    CHECK(is(stranger, "certificate", "ok"));
    CHECK(is(stranger, "desk", "broken"));

    Words missing = keys.of("me");
    missing[3] = keys / "nobody.crt";
    CHECK(is(doctor(lab.cluster(), missing), "certificate", "broken", "nobody.crt: No such file"));
    // In the clear to a controller that wants to see a certificate.
    CHECK(is(doctor(lab.cluster(), {"--insecure"}), "desk", "broken"));
  }
}
