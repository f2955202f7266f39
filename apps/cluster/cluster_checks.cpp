#include "apps/cluster/cluster_checks.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <future>
#include <map>
#include <memory>
#include <set>

#include "actors/link/keys.hpp"
#include "actors/link/socket.hpp"
#include "apps/cluster/desk.hpp"
#include "apps/cluster/machine_facts.hpp"

namespace lichthof::apps {

namespace {

using namespace std::chrono_literals;

constexpr double soon_days = 30;
constexpr double poor_offset_s = 2, broken_offset_s = 1800;  // new certificates begin an hour in the past
constexpr double silent_s = 5;
constexpr auto dial_limit = 5s;

double now_s() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

bool is_here(const std::string& address) { return address.starts_with("127.") || address == "::1"; }

std::string numeric(const sockaddr* address, socklen_t length) {
  char text[NI_MAXHOST] = {};
  if (::getnameinfo(address, length, text, sizeof text, nullptr, 0, NI_NUMERICHOST) != 0) return {};
  return text;
}

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;
/// Null where the name is not known; then `why` says why.
Addresses addresses_of(const std::string& name, std::string& why) {
  addrinfo hints = {}, *found = nullptr;
  hints.ai_socktype = SOCK_DGRAM;
  const int problem = ::getaddrinfo(name.c_str(), nullptr, &hints, &found);
  if (problem != 0) why = ::gai_strerror(problem), found = nullptr;
  return {found, &::freeaddrinfo};
}

std::set<std::string> numeric_addresses(const std::string& name) {
  std::string ignored;
  std::set<std::string> all;
  const Addresses found = addresses_of(name, ignored);
  for (const addrinfo* one = found.get(); one; one = one->ai_next) all.insert(numeric(one->ai_addr, one->ai_addrlen));
  return all;
}

std::string listed(const std::set<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// ---- Certificates -----------------------------------------------------------------------------------------------------

/// "2026-01-31T12:00:00Z"
double days_until(const std::string& utc) {
  std::tm parts{};
  if (!::strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts)) return 0;
  return (static_cast<double>(::timegm(&parts)) - now_s()) / 86400;
}

/// What is wrong, and the mend where a message names one.
Finding broken(const std::string& name, const std::string& text, const std::string& mend) {
  for (const char* sign : {"; run: ", "; issue one with ", "; "})
    if (const std::size_t at = text.find(sign); at != std::string::npos)
      return {name, Health::broken, text.substr(0, at), text.substr(at + 2)};
  return {name, Health::broken, text, mend};
}

Finding validity(const char* check, const std::string& path, const char* mend) {
  const Expected<std::vector<actors::CertificateFacts>> facts = actors::certificate_facts(path);
  if (!facts) return broken(check, facts.error().text(), mend);
  const actors::CertificateFacts& one = facts->front();
  const double days = days_until(one.valid_to);
  const std::string text = one.role + " " + one.name + ", valid to " + one.valid_to;
  if (!one.problem.empty()) return {check, Health::broken, text + ": " + one.problem, mend};
  if (days < soon_days) return {check, Health::poor, text + ": only " + std::to_string(int(days)) + " days", mend};
  return {check, Health::good, text, ""};
}

std::vector<Finding> certificates(const ClusterChoice& choice) {
  const char* pair =
      "issue a new pair on the machine that has the lab's keys: lichthof keys issue DIR --name NAME --role ROLE";
  if (choice.is_clear && actors::is_loopback(choice.address.host))
    return {{"certificate", Health::good, "none is needed on this machine", ""}};
  if (choice.is_clear)
    return {{"certificate", Health::poor, "none is used: anybody may listen, and speak for anybody",
             "leave --insecure away, and give --authority, --certificate and --key"}};
  const Expected<std::shared_ptr<const actors::TlsContext>> tls = actors::TlsContext::load(choice.files);
  if (!tls) return {broken("certificate", tls.error().text(), pair)};
  Finding own = validity("certificate", choice.files.certificate, pair);
  const actors::Identity& who = (*tls)->own();
  if (own.health == Health::good && who.role == actors::Role::node && who.name != machine_name())
    own = {"certificate", Health::poor, "it is of node " + who.name + ", but this machine is " + machine_name(),
           "give each machine its own pair: lichthof keys issue DIR --name " + machine_name() + " --role node"};
  return {own, validity("authority", choice.files.authority,
                        "make a new authority (lichthof keys init) and new pairs for everybody before that day")};
}

// ---- Names and addresses ----------------------------------------------------------------------------------------------

Finding own_name(bool is_lab_elsewhere) {
  char name[256] = {};
  ::gethostname(name, sizeof name - 1);
  const std::set<std::string> addresses = numeric_addresses(name);
  const std::string text = std::string(name) + " is " + (addresses.empty() ? "not known" : listed(addresses));
  const bool is_only_here = std::all_of(addresses.begin(), addresses.end(), is_here);
  if (!is_only_here) return {"host name", Health::good, text, ""};
  // What nobody dials does no harm.
  return {"host name", is_lab_elsewhere ? Health::poor : Health::good, text,
          is_lab_elsewhere ? "programs here that listen at their own name are reached by nobody: write this machine's "
                             "address beside its name in /etc/hosts, or give --listen ADDRESS"
                           : ""};
}

/// Addresses of this machine that are not loopback, with their interfaces.
std::map<std::string, std::string> own_addresses() {
  std::map<std::string, std::string> all;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return all;
  for (const ifaddrs* one = list; one; one = one->ifa_next) {
    if (!one->ifa_addr || (one->ifa_flags & IFF_LOOPBACK) || !(one->ifa_flags & IFF_UP)) continue;
    if (one->ifa_addr->sa_family == AF_INET) all[numeric(one->ifa_addr, sizeof(sockaddr_in))] = one->ifa_name;
  }
  ::freeifaddrs(list);
  return all;
}

/// Our end of the way to a host; nothing is sent. Empty: there is no way.
std::string own_end_towards(const addrinfo& host) {
  const actors::Socket socket(::socket(host.ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_storage there = {}, here = {};
  std::copy_n(reinterpret_cast<const char*>(host.ai_addr), host.ai_addrlen, reinterpret_cast<char*>(&there));
  // Any port but 0, which some kernels refuse.
  (host.ai_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(there).sin6_port
                              : reinterpret_cast<sockaddr_in&>(there).sin_port) = htons(default_desk_port);
  socklen_t length = sizeof here;
  if (socket.fd() < 0 || ::connect(socket.fd(), reinterpret_cast<sockaddr*>(&there), host.ai_addrlen) != 0 ||
      ::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&here), &length) != 0)
    return {};
  return numeric(reinterpret_cast<sockaddr*>(&here), length);
}

/// @param way  set to our end of it
Finding address(const DeskAddress& controller, std::string& way) {
  std::string why;
  const Addresses there = addresses_of(controller.host, why);
  if (!there)
    return {"address", Health::broken, controller.host + ": " + why,
            "write its address instead of its name, or its name into /etc/hosts or the name server"};
  way = own_end_towards(*there);
  if (way.empty())
    return {"address", Health::broken, "there is no way to " + numeric(there->ai_addr, there->ai_addrlen),
            "check cable, network and routes of this machine"};
  const std::map<std::string, std::string> own = own_addresses();
  if (is_here(way)) {
    std::set<std::string> others;
    for (const auto& [one, interface] : own) others.insert(one);
    return {"address", Health::good,
            "the controller is on this machine" + (others.empty() ? "" : "; others reach it at " + listed(others)), ""};
  }
  std::set<std::string> interfaces;
  for (const auto& [one, interface] : own) interfaces.insert(interface + " " + one);
  const auto found = own.find(way);
  const std::string text = "a node here is known to others as " + way +
                           (found == own.end() ? "" : " (" + found->second + ")") +
                           (interfaces.size() > 1 ? "; this machine has " + listed(interfaces) : "");
  if (interfaces.size() < 2) return {"address", Health::good, text, ""};
  return {"address", Health::poor, text, "the other nodes must reach that one: start the node with --listen " + way};
}

// ---- The controller ---------------------------------------------------------------------------------------------------

Finding port_of_nodes(const std::string& host, std::uint16_t port) {
  const auto answer = std::make_shared<std::promise<std::string>>();
  std::future<std::string> problem = answer->get_future();
  actors::Dialler dialler;
  dialler.dial(host, port, dial_limit, [answer](const Expected<actors::Socket>& socket) {
    answer->set_value(socket ? "" : socket.error().message);
  });
  const std::string where = actors::endpoint(host, port);
  const bool is_told = problem.wait_for(2 * dial_limit) == std::future_status::ready;
  const std::string why = is_told ? problem.get() : "no answer in time";
  if (why.empty()) return {"port of nodes", Health::good, where + " can be reached", ""};
  return {"port of nodes", Health::broken, where + ": " + why, "open this port in the firewalls between"};
}

Finding clock(double controller_s, double asked_s, double answered_s) {
  const double offset_s = controller_s - (asked_s + answered_s) / 2, unsure_s = (answered_s - asked_s) / 2;
  const double off = std::max(0.0, std::abs(offset_s) - unsure_s);
  char text[128];
  std::snprintf(text, sizeof text, "the controller's is %.3f s %s of this one's, give or take %.3f s",
                std::abs(offset_s), offset_s < 0 ? "behind" : "ahead", unsure_s);
  if (off < poor_offset_s) return {"clock", Health::good, text, ""};
  return {"clock", off < broken_offset_s ? Health::poor : Health::broken, text,
          "let both follow a time server: apt install systemd-timesyncd"};
}

Finding version(const std::string& theirs) {
  const std::string text = "controller " + theirs + ", here " + LICHTHOF_VERSION;
  if (theirs == LICHTHOF_VERSION) return {"version", Health::good, text, ""};
  return {"version", Health::broken, text, "install the same version everywhere: deploy/install-lab"};
}

std::vector<Finding> nodes(const nlohmann::json& all, bool is_lab_elsewhere) {
  if (!all.is_array() || all.empty())
    return {{"nodes", Health::poor, "none has joined", "start some: lichthof node --join CONTROLLER"}};
  std::map<std::string, int> states;
  std::vector<Finding> findings{{}};
  for (const auto& node : all) {
    const std::string name = node.value("name", "?"), host = node.value("host", ""), state = node.value("state", "?");
    const std::string check = "node " + name, running = node.value("version", "");
    ++states[state];
    char silence[48];
    std::snprintf(silence, sizeof silence, "silent for %.0f s", node.value("seen_s", 0.0));
    if (node.value("seen_s", 0.0) > silent_s)
      findings.push_back({check, Health::poor, silence, "look whether its machine hangs, and the network to it"});
    if (is_lab_elsewhere && is_here(host) && all.size() > 1)
      findings.push_back({check, Health::poor, "the others look for it at " + host + ", which is themselves",
                          "start it with --join and --listen of an address that they reach"});
    if (!running.empty() && running != LICHTHOF_VERSION)
      findings.push_back({check, Health::broken, "runs " + running + ", here " + LICHTHOF_VERSION,
                          "install the same version everywhere: deploy/install-lab"});
    if (state == "draining")
      findings.push_back(
          {check, Health::poor, "is drained: it gets no work", "lichthof shell -c 'drain " + name + " off'"});
  }
  std::string text;
  for (const auto& [state, count] : states) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + state;
  findings.front() = {"nodes", Health::good, text, ""};
  return findings;
}

}  // namespace

std::vector<Finding> cluster_findings(const ClusterOptions& options) {
  const Expected<ClusterChoice> choice = cluster_choice(options);
  if (!choice) return {broken("cluster", choice.error().text(), "see lichthof doctor --help")};
  const std::string& host = choice->address.host;
  const bool is_lab_elsewhere = !actors::is_loopback(host);
  std::vector<Finding> findings{own_name(is_lab_elsewhere)};
  std::string way;
  findings.push_back(address(choice->address, way));
  for (Finding& finding : certificates(*choice)) findings.push_back(std::move(finding));
  for (const Finding& finding : findings)
    if (finding.health == Health::broken) return findings;

  const Expected<DeskClient> client = desk_client(options);
  if (!client) return findings.push_back(broken("desk", client.error().text(), "")), findings;
  const double asked_s = now_s();
  const Expected<nlohmann::json> lab = client->get("/v1/lab");
  const double answered_s = now_s();
  if (!lab) {
    findings.push_back(broken("desk", lab.error().text(),
                              "start lichthof controller there, and open this port in the firewalls between"));
    return findings;
  }
  findings.push_back({"desk", Health::good, actors::endpoint(host, choice->address.port) + " answers", ""});
  findings.push_back(port_of_nodes(host, lab->value("nodes_port", std::uint16_t{0})));
  findings.push_back(clock(lab->value("time_s", 0.0), asked_s, answered_s));
  findings.push_back(version(lab->value("version", "unknown")));
  const Expected<nlohmann::json> all = client->get("/v1/nodes");
  if (!all) return findings.push_back(broken("nodes", all.error().text(), "")), findings;
  for (Finding& finding : nodes(*all, is_lab_elsewhere)) findings.push_back(std::move(finding));
  return findings;
}

}  // namespace lichthof::apps
