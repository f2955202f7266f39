#include "tests/system/real_lab.hpp"

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "io/image_writer.hpp"
#include "io/solution_file.hpp"

namespace lichthof::testing {

namespace {

/// As the trials of the issue state it: a ledger that is off by a millionth of what was emitted is wrong.
constexpr double most_ledger_error = 1e-6;

const std::vector<std::string> picture_options{"--size", "160x120", "--samples", "8"};

Trials trials_asked() {
  Trials trials;
  const char* variable = std::getenv("LICHTHOF_TRIALS");
  if (!variable) return trials;
  std::istringstream all(variable);
  for (std::string one; std::getline(all, one, ',');) {
    if (one == "long") {
      trials.kills = 20, trials.hang_s = 60, trials.restarts = 20, trials.stops = 100, trials.soak_s = 3600;
      trials.slow_elements = 30000;
      continue;
    }
    const std::string name = one.substr(0, one.find('='));
    std::uint32_t* const count = name == "seed"            ? &trials.seed
                                 : name == "kills"         ? &trials.kills
                                 : name == "hang_s"        ? &trials.hang_s
                                 : name == "restarts"      ? &trials.restarts
                                 : name == "stops"         ? &trials.stops
                                 : name == "soak_s"        ? &trials.soak_s
                                 : name == "elements"      ? &trials.elements
                                 : name == "slow_elements" ? &trials.slow_elements
                                                           : nullptr;
    const char* const value = one.c_str() + std::min(name.size() + 1, one.size());
    char* end = nullptr;
    const unsigned long number = std::strtoul(value, &end, 10);
    if (!count || end == value || *end != '\0')
      FAIL("LICHTHOF_TRIALS: '" << one << "' is neither long nor NAME=NUMBER of seed kills hang_s restarts stops "
                                << "soak_s elements slow_elements");
    *count = static_cast<std::uint32_t>(number);
  }
  return trials;
}

/// The ledger of a solution, from the light of its elements alone.
EnergyLedger recounted(const Solution& solution) {
  EnergyLedger ledger;
  const Rgb white{1.0};
  for (const Patch& patch : solution.mesh->patches)
    for (std::uint32_t k = patch.first_element; k < patch.first_element + patch.element_count; ++k) {
      const double area = solution.mesh->elements[k].area;
      const Rgb received{solution.irradiance[k]}, shot{solution.shot[k]};
      ledger.emitted += area * sum_channels(patch.exitance);
      ledger.absorbed += area * sum_channels((white - patch.reflectance) * received);
      ledger.unshot += area * sum_channels(patch.exitance + patch.reflectance * received - shot);
    }
  return ledger;
}

}  // namespace

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

const Trials& Trials::asked() {
  static const Trials trials = trials_asked();
  return trials;
}

// ---- Processes --------------------------------------------------------------------------------------------------------

RealLab::RealLab(const Setup& setup) : checkpoint_s_(setup.checkpoint_s) {
  write_room(folder_), write_tiled_room(folder_);
  if (setup.has_hosts) {
    Expected<std::unique_ptr<LabNetwork>> network = LabNetwork::make(1 + setup.nodes.size());
    if (network)
      network_ = std::move(*network), address_ = network_->address(0);
    else
      MESSAGE("no hosts of their own, " << network.error().text()
                                        << "; all is on loopback, and who is cut off is stopped (try unshare -Ur)");
  }
  if (network_) {
    REQUIRE(ran({"keys", "init", folder_ / "keys"}).status == 0);
    const auto issue = [&](const std::string& name, const char* role) {
      REQUIRE(ran({"keys", "issue", folder_ / "keys", "--name", name, "--role", role}).status == 0);
    };
    issue("lab", "controller"), issue("me", "user");
    for (const std::string& name : setup.nodes) issue(name, "node");
  }
  for (const std::string& name : setup.nodes) hosts_.emplace(name, hosts_.size() + 1);
  start_controller();
  for (const std::string& name : setup.nodes) start(name);
  REQUIRE(until([&] { return node_count() == setup.nodes.size(); }));
}

std::vector<std::string> RealLab::keys(const std::string& name) const {
  if (!network_) return {};
  return {"--authority",   folder_ / "keys/ca.crt",
          "--certificate", folder_ / ("keys/" + name + ".crt"),
          "--key",         folder_ / ("keys/" + name + ".key")};
}

void RealLab::start_controller() {
  Surroundings around;
  around.stdout_to = folder_ / "ports";
  if (network_) around.network = network_->file(0);
  controller_.reset();
  std::remove(around.stdout_to.c_str());
  std::vector<std::string> words{"controller",
                                 "--listen",
                                 address_,
                                 "--port",
                                 people_,
                                 "--node-port",
                                 nodes_port_,
                                 "--state",
                                 folder_ / "state",
                                 "--checkpoint",
                                 std::to_string(checkpoint_s_),
                                 "--json"};
  for (const std::string& word : keys("lab")) words.push_back(word);
  controller_ = std::make_unique<Process>(words, around);
  const bool has_begun = until([&] { return contents(around.stdout_to).find('}') != std::string::npos; }, 30);
  INFO(controller_->said());
  REQUIRE(has_begun);
  const nlohmann::json ports = nlohmann::json::parse(contents(around.stdout_to));
  people_ = std::to_string(ports["people"].get<int>()), nodes_port_ = std::to_string(ports["nodes"].get<int>());
}

void RealLab::kill_controller() {
  controller_->signal(SIGKILL);
  controller_->finish();
}

void RealLab::start(const std::string& name) {
  Surroundings around;
  std::vector<std::string> words{
      "node", "--join", address_ + ":" + nodes_port_, "--name", name, "--threads", "1", "--cache", folder_ / "cache"};
  const std::size_t host = hosts_.emplace(name, hosts_.size() + 1).first->second;
  if (network_) {
    around.network = network_->file(host);
    words.insert(words.end(), {"--listen", network_->address(host)});
  }
  for (const std::string& word : keys(name)) words.push_back(word);
  nodes_[name] = std::make_unique<Process>(words, around);
}

void RealLab::kill(const std::string& name) {
  node(name).signal(SIGKILL);
  node(name).finish();
}

bool RealLab::port_is_free(const std::string& port) const {
  const int probe = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(probe, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::atoi(port.c_str())));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool is_free = ::bind(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(probe);
  return is_free;
}

void RealLab::cut(const std::vector<std::string>& names, bool is_cut) {
  for (const std::string& name : names)
    if (network_)
      network_->put(host(name), is_cut ? 1 : 0);
    else
      node(name).signal(is_cut ? SIGSTOP : SIGCONT);
}

// ---- Questions --------------------------------------------------------------------------------------------------------

Outcome RealLab::ran_here(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(), {"--cluster", address_ + ":" + people_});
  for (const std::string& word : keys("me")) arguments.push_back(word);
  Surroundings around;
  if (network_) around.network = network_->file(0);
  return ran(arguments, around);
}

nlohmann::json RealLab::asked(std::vector<std::string> arguments) {
  arguments.push_back("--json");
  const nlohmann::json answer = nlohmann::json::parse(ran_here(std::move(arguments)).out, nullptr, false);
  return answer.is_object() ? answer : nlohmann::json::object();
}

std::string RealLab::submit(const std::string& eps, std::uint32_t elements) {
  std::vector<std::string> words{"submit",     folder_ / "room.toml",    "--cells", "2x2",
                                 "--elements", std::to_string(elements), "--eps",   eps};
  words.insert(words.end(), picture_options.begin(), picture_options.end());
  words.push_back("--json");
  const Outcome outcome = ran_here(words);
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  return std::to_string(outcome.json()["id"].get<int>());
}

std::string RealLab::submit_tiles() {
  std::vector<std::string> words{
      "submit", folder_ / "tiles.toml", "--cells", "2x1", "--patch", "0.5", "--element", "0.5", "--eps", "1e-8"};
  words.insert(words.end(), picture_options.begin(), picture_options.end());
  const nlohmann::json answer = asked(words);
  REQUIRE(answer.contains("id"));
  return std::to_string(answer["id"].get<int>());
}

bool RealLab::is_over(const std::string& id) {
  const std::string now = job_state(id);
  return now == "done" || now == "failed" || now == "cancelled";
}

std::string RealLab::log(const std::string& id) { return ran_here({"jobs", "log", id}).out; }

std::string RealLab::fetched(const std::string& id, const std::string& ending) {
  const std::string path = folder_ / ("job" + id + ending);
  REQUIRE(ran_here({"jobs", "result", id, "-o", path, "--quiet"}).status == 0);
  return path;
}

std::vector<float> RealLab::picture(const std::string& id) {
  const Expected<io::Image> image = io::read_image(fetched(id, ".exr"));
  REQUIRE(image);
  return image->rgb;
}

std::vector<float> RealLab::light(const std::string& id) {
  const Expected<Solution> solution = io::read_solution(fetched(id, ".lht"));
  REQUIRE(solution);
  std::vector<float> light;
  for (const Rgbf& h : solution->irradiance) light.insert(light.end(), {h.x, h.y, h.z});
  return light;
}

std::vector<float> RealLab::picture_here(const std::string& id) {
  const std::string path = folder_ / ("here" + id + ".exr");
  std::vector<std::string> words{"render", fetched(id, ".lht"), "-o", path, "--quiet"};
  words.insert(words.end(), picture_options.begin(), picture_options.end());
  REQUIRE(ran(words).status == 0);
  const Expected<io::Image> image = io::read_image(path);
  REQUIRE(image);
  return image->rgb;
}

void RealLab::expect_done(const std::string& id) {
  REQUIRE(until([&] { return is_over(id); }));
  const nlohmann::json done = job(id);
  INFO(done.dump() << "\n" << log(id));
  REQUIRE(done["state"] == "done");
  CHECK(picture(id) == picture_here(id));
  // The sums that cells kept through moves and restarts are those of the light that arrived.
  const Expected<Solution> light = io::read_solution(fetched(id, ".lht"));
  REQUIRE(light);
  const EnergyLedger counted = recounted(*light);
  const double emitted = light->energy.emitted;
  CHECK(std::abs(counted.emitted - emitted) < most_ledger_error * emitted);
  CHECK(std::abs(counted.absorbed - light->energy.absorbed) < most_ledger_error * emitted);
  CHECK(std::abs(counted.unshot - light->energy.unshot) < most_ledger_error * emitted);
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double square = 0, mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) square += (a[i] - b[i]) * (a[i] - b[i]), mean += b[i];
  return std::sqrt(square / static_cast<double>(a.size())) / (mean / static_cast<double>(a.size()));
}

}  // namespace lichthof::testing
