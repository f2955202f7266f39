/// A lab of real processes on loopback: a controller, nodes, and what happens to a job when some of them die.
#include <doctest/doctest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <map>
#include <thread>

#include "core/base/random.hpp"
#include "io/image_writer.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;
using namespace std::chrono_literals;

namespace {

constexpr double patience_s = 120;  // for a busy machine; nothing takes so long unless it is broken

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class RealLab {
 public:
  explicit RealLab(std::vector<std::string> nodes) {
    start_controller("0", "0");
    for (const std::string& name : nodes) start(name);
    REQUIRE(until([&] { return node_count() == nodes.size(); }));
  }

  void start_controller(const std::string& port, const std::string& node_port) {
    Surroundings around;
    around.stdout_to = folder_ / "ports";
    controller_.reset();
    std::remove(around.stdout_to.c_str());
    controller_ = std::make_unique<Process>(
        std::vector<std::string>{"controller", "--port", port, "--node-port", node_port, "--state", folder_ / "state",
                                 "--checkpoint", "0.3", "--json"},
        around);
    REQUIRE(until([&] { return contents(around.stdout_to).find('}') != std::string::npos; }));
    const nlohmann::json ports = nlohmann::json::parse(contents(around.stdout_to));
    people_ = std::to_string(ports["people"].get<int>()), nodes_port_ = std::to_string(ports["nodes"].get<int>());
  }
  void restart_controller() {
    const std::string people = people_, nodes = nodes_port_;
    controller_->signal(SIGKILL);
    controller_->finish();
    start_controller(people, nodes);
  }
  void start(const std::string& name) {
    nodes_[name] = std::make_unique<Process>(std::vector<std::string>{
        "node", "--join", "127.0.0.1:" + nodes_port_, "--name", name, "--threads", "1", "--cache", folder_ / "cache"});
  }
  Process& node(const std::string& name) { return *nodes_.at(name); }
  void kill(const std::string& name) {
    node(name).signal(SIGKILL);
    node(name).finish();
  }

  /// The answer to a command, which must be one JSON document.
  nlohmann::json asked(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--cluster", "127.0.0.1:" + people_, "--json"});
    const Outcome outcome = ran(arguments);
    nlohmann::json answer = nlohmann::json::parse(outcome.out, nullptr, false);
    return answer.is_object() ? answer : nlohmann::json::object();
  }
  std::size_t node_count() { return asked({"shell", "-c", "nodes"}).value("nodes", nlohmann::json::array()).size(); }
  template <class Condition>
  bool until(Condition condition) {
    for (const double end = now_s() + patience_s; now_s() < end;) {
      if (condition()) return true;
      std::this_thread::sleep_for(30ms);
    }
    return false;
  }

  std::string submit(const std::string& eps) {
    write_room(folder_);
    const nlohmann::json answer = asked({"submit", folder_ / "room.toml", "--cells", "2x2", "--elements", "6000",
                                         "--eps", eps, "--size", "160x120", "--samples", "8"});
    REQUIRE(answer.contains("id"));
    return std::to_string(answer["id"].get<int>());
  }
  nlohmann::json job(const std::string& id) { return asked({"jobs", id}).value("job", nlohmann::json::object()); }
  std::string state(const std::string& id) { return job(id).value("state", ""); }
  bool is_over(const std::string& id) {
    const std::string now = state(id);
    return now == "done" || now == "failed" || now == "cancelled";
  }
  bool is_in(const std::string& id, const std::string& pass) { return job(id).value("pass", "") == pass; }
  std::vector<float> picture(const std::string& id) {
    const std::string path = folder_ / ("picture" + id + ".exr");
    REQUIRE(ran({"jobs", "result", id, "-o", path, "--cluster", "127.0.0.1:" + people_, "--quiet"}).status == 0);
    const Expected<io::Image> image = io::read_image(path);
    REQUIRE(image);
    return image->rgb;
  }
  /// The same second pass in one process, on the job's own light.
  std::vector<float> picture_here(const std::string& id) {
    const std::string light = folder_ / ("light" + id + ".lht"), path = folder_ / ("here" + id + ".exr");
    REQUIRE(ran({"jobs", "result", id, "-o", light, "--cluster", "127.0.0.1:" + people_, "--quiet"}).status == 0);
    REQUIRE(ran({"render", light, "-o", path, "--size", "160x120", "--samples", "8", "--quiet"}).status == 0);
    const Expected<io::Image> image = io::read_image(path);
    REQUIRE(image);
    return image->rgb;
  }

 private:
  Folder folder_;
  std::string people_, nodes_port_;
  std::unique_ptr<Process> controller_;
  std::map<std::string, std::unique_ptr<Process>> nodes_;
};

/// Root mean square of the difference, relative to the mean of b.
double difference(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double square = 0, mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) square += (a[i] - b[i]) * (a[i] - b[i]), mean += b[i];
  return std::sqrt(square / static_cast<double>(a.size())) / (mean / static_cast<double>(a.size()));
}

void expect_done(RealLab& lab, const std::string& id) {
  REQUIRE(lab.until([&] { return lab.is_over(id); }));
  const nlohmann::json job = lab.job(id);
  INFO(job.dump());
  REQUIRE(job["state"] == "done");
  CHECK(lab.picture(id) == lab.picture_here(id));
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("lab: kill -9 of one node and of two, in each pass, loses nothing") {
    RealLab lab({"anna", "bert", "carl", "dora"});
    const std::string whole = lab.submit("1e-5");
    expect_done(lab, whole);
    const nlohmann::json expected = lab.job(whole);
    Random random(77);
    for (const std::string pass : {"radiosity", "picture"})
      for (const std::vector<std::string>& victims : {std::vector<std::string>{"bert"}, {"anna", "carl"}}) {
        CAPTURE(pass);
        const std::string id = lab.submit("1e-5");
        REQUIRE(lab.until([&] { return lab.is_in(id, pass) || lab.is_over(id); }));
        std::this_thread::sleep_for(std::chrono::milliseconds(random.below(pass == "radiosity" ? 600 : 100)));
        for (const std::string& victim : victims) lab.kill(victim);
        expect_done(lab, id);
        const nlohmann::json job = lab.job(id);
        // Rays and hemicubes stand where a shot's light leaves, so the order of shots moves the ledger by some 1e-4; a shot
        // that was lost or counted twice would move it by more.
        const double residual = job["energy"]["residual"], undisturbed = expected["energy"]["residual"];
        CHECK(std::abs(residual - undisturbed) < 1e-3);
        CHECK(difference(lab.picture(id), lab.picture(whole)) < 5e-3);
        for (const std::string& victim : victims) lab.start(victim);
        REQUIRE(lab.until([&] { return lab.node_count() == 4; }));
      }
  }

  TEST_CASE("lab: a node that hangs is noticed, and counts for nothing when it comes back") {
    RealLab lab({"anna", "bert"});
    const std::string id = lab.submit("1e-4");
    REQUIRE(lab.until([&] { return lab.is_in(id, "radiosity"); }));
    lab.node("bert").signal(SIGSTOP);
    const double stopped = now_s();
    REQUIRE(lab.until([&] { return lab.node_count() == 1; }));
    CHECK(now_s() - stopped < 11);  // silence of 6 s, and a second to look
    expect_done(lab, id);
    lab.node("bert").signal(SIGCONT);
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    const std::string next = lab.submit("1e-4");
    expect_done(lab, next);
  }

  TEST_CASE("lab: a node stopped during the picture, and going on later, leaves the picture as it is") {
    RealLab lab({"anna", "bert", "carl"});
    const std::string id = lab.submit("1e-3");
    REQUIRE(lab.until([&] { return lab.is_in(id, "picture") || lab.is_over(id); }));
    lab.node("bert").signal(SIGSTOP);
    std::this_thread::sleep_for(3s);
    lab.node("bert").signal(SIGCONT);
    expect_done(lab, id);
    CHECK(lab.node_count() == 3);
  }

  TEST_CASE("lab: a controller killed with -9 takes its jobs up again") {
    RealLab lab({"anna", "bert"});
    const std::string first = lab.submit("1e-5"), second = lab.submit("1e-4");
    REQUIRE(lab.until([&] { return lab.job(first).value("checkpoint", false) || lab.is_over(first); }));
    lab.restart_controller();
    expect_done(lab, first);
    expect_done(lab, second);
  }
}
