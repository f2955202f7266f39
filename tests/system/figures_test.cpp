/// What controller and nodes tell Prometheus, read as strictly as its text format is written.
#include "apps/cluster/figures.hpp"

#include <httplib.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "actors/link/keys.hpp"
#include "tests/system/loopback_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

struct Figures {
  std::map<std::string, std::string> types;  ///< by name
  std::map<std::string, double> values;      ///< by name with labels
  std::vector<std::string> faults;

  double sum(const std::string& name) const {
    double all = 0;
    for (const auto& [series, value] : values)
      if (series.substr(0, series.find('{')) == name) all += value;
    return all;
  }
};

/// Reads the text format 0.0.4, and the naming rules of Prometheus.
Figures figures_in(const std::string& text) {
  static const std::regex help("# HELP ([a-z_:][a-z0-9_:]*) (.+)"), type("# TYPE ([a-z_:][a-z0-9_:]*) (counter|gauge)"),
      sample(R"(([a-z_:][a-z0-9_:]*)(\{([a-z_]+="[^"\\]*",?)+\})? (-?[0-9.e+-]+))");
  Figures figures;
  std::set<std::string> helped, closed;
  std::string current, line;
  std::istringstream lines(text);
  if (text.empty() || text.back() != '\n') figures.faults.push_back("no end of line at the end");
  while (std::getline(lines, line)) {
    std::smatch part;
    const auto fault = [&](const char* what) { figures.faults.push_back(what + (": " + line)); };
    if (std::regex_match(line, part, help)) {
      if (!helped.insert(part[1]).second) fault("a second HELP");
      if (!current.empty()) closed.insert(current);
      current = part[1];
    } else if (std::regex_match(line, part, type)) {
      if (part[1] != current) fault("TYPE without its HELP");
      if (!figures.types.emplace(part[1], part[2]).second) fault("a second TYPE");
      const bool is_counter = part[2] == "counter", is_total = std::string(part[1]).ends_with("_total");
      if (is_counter != is_total) fault("counters end with _total, and nothing else does");
    } else if (std::regex_match(line, part, sample)) {
      if (part[1] != current || closed.count(part[1]) || !figures.types.count(part[1])) fault("outside its group");
      const double value = std::stod(part[4]);
      if (!std::isfinite(value)) fault("no number");
      if (!figures.values.emplace(std::string(part[1]) + std::string(part[2]), value).second) fault("a second sample");
    } else {
      fault("not of the format");
    }
  }
  return figures;
}

Figures scraped(std::uint16_t port) {
  httplib::Client client("127.0.0.1", port);
  const httplib::Result result = client.Get("/metrics");
  REQUIRE(result);
  CHECK(result->status == 200);
  CHECK(result->get_header_value("Content-Type") == apps::figures_type);
  Figures figures = figures_in(result->body);
  INFO(result->body);
  for (const std::string& fault : figures.faults) FAIL_CHECK(fault);
  return figures;
}

void expect_no_counter_fell(const Figures& before, const Figures& after) {
  for (const auto& [series, value] : before.values)
    if (before.types.at(series.substr(0, series.find('{'))) == "counter") {
      CAPTURE(series);
      REQUIRE(after.values.count(series));
      CHECK(after.values.at(series) >= value);
    }
}

/// The port on which a node has said that it shows figures.
std::uint16_t figures_port(Process& node) {
  REQUIRE(node.says("/metrics"));
  const std::string text = node.said();
  std::smatch part;
  REQUIRE(std::regex_search(text, part, std::regex("figures: 127\\.0\\.0\\.1:([0-9]+)/metrics")));
  return static_cast<std::uint16_t>(std::stoi(part[1]));
}

/// The names in the queries of the Grafana dashboard.
std::set<std::string> dashboard_names() {
  const nlohmann::json dashboard =
      nlohmann::json::parse(contents(std::string(LICHTHOF_SOURCE_DIR) + "/deploy/grafana/lichthof.json"));
  static const std::regex name("\\b(lichthof|process)_[a-z0-9_]+");
  std::set<std::string> names;
  for (const auto& panel : dashboard["panels"])
    for (const auto& target : panel["targets"]) {
      const std::string query = target["expr"];
      for (std::sregex_iterator at(query.begin(), query.end(), name), end; at != end; ++at) names.insert(at->str());
    }
  return names;
}

nlohmann::json node_document(int id, const char* name, double shots) {
  return {{"id", id},    {"name", name}, {"state", "busy"}, {"shots", shots},
          {"rays", 1e9}, {"cores", 4},   {"bytes_in", 5},   {"bytes_out", 6}};
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("figures: the reader of this test finds what is wrong") {
    CHECK(figures_in("# HELP a_total x\n# TYPE a_total counter\na_total 1\na_total{n=\"b\"} 2\n").faults.empty());
    for (const char* wrong :
         {"# HELP a x\n# TYPE a counter\na 1\n", "# HELP a_total x\n# TYPE a_total gauge\na_total 1\n", "a 1\n",
          "# HELP a x\n# TYPE a gauge\na 1\na 2\n", "# HELP a x\n# TYPE a gauge\na one\n",
          "# HELP a x\n# TYPE a gauge\na 1",
          "# HELP a x\n# TYPE a gauge\na 1\n# HELP b x\n# TYPE b gauge\nb 1\na{c=\"d\"} 1\n",
          "# HELP a x\n# TYPE a gauge\na{b=\"c\" 1\n", "# HELP a x\n# HELP a x\n# TYPE a gauge\n"}) {
      CAPTURE(wrong);
      CHECK_FALSE(figures_in(wrong).faults.empty());
    }
  }

  TEST_CASE("figures: a node that goes takes its gauges along, its counters stay and go on") {
    apps::LabFigures figures("1");
    const auto array = [](std::vector<nlohmann::json> all) { return nlohmann::json(all); };
    const nlohmann::json none = nlohmann::json::array();
    figures.look(array({node_document(1, "anna", 100), node_document(2, "bert", 10)}), none);
    figures.look(array({node_document(1, "anna", 150)}), none);
    figures.look(array({node_document(1, "anna", 120)}), none);  // can't be, and changes nothing
    const Figures gone = figures_in(figures.text());
    CHECK(gone.faults.empty());
    CHECK(gone.values.at("lichthof_lab_node_shots_total{node=\"anna\"}") == 150);
    CHECK(gone.values.at("lichthof_lab_node_shots_total{node=\"bert\"}") == 10);
    CHECK(gone.values.count("lichthof_lab_node_cores{node=\"anna\"}") == 1);
    CHECK(gone.values.count("lichthof_lab_node_cores{node=\"bert\"}") == 0);
    CHECK(gone.values.at("lichthof_lab_nodes{state=\"busy\"}") == 1);
    // It begins to count anew with each stay, however soon it has done more than before.
    figures.look(array({node_document(1, "anna", 150), node_document(3, "bert", 12)}), none);
    const Figures back = figures_in(figures.text());
    CHECK(back.values.at("lichthof_lab_node_shots_total{node=\"bert\"}") == 22);
    CHECK(back.values.at("lichthof_lab_node_rays_total{node=\"bert\"}") == 2e9);
    expect_no_counter_fell(gone, back);
  }

  TEST_CASE("figures: of a lab at work, all that the dashboard names, and no counter falls when a node dies") {
    LoopbackLab lab;
    const std::uint16_t anna = figures_port(lab.start("anna", {"--metrics", "0"}));
    lab.start("bert");
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    const std::string job = lab.submit();
    const auto is_busy = [](const Figures& seen) {
      return seen.sum("lichthof_lab_node_shots_total") > 0 && seen.sum("lichthof_lab_job_unshot_watts") > 0;
    };
    Figures busy;
    REQUIRE(lab.until([&] { return is_busy(busy = scraped(lab.people())); }));
    CHECK(busy.sum("lichthof_lab_node_rays_total") > 0);
    CHECK(busy.values.at("lichthof_lab_jobs{state=\"running\"}") == 1);
    CHECK(busy.sum("lichthof_lab_nodes") == 2);
    Figures node;
    REQUIRE(lab.until([&] { return (node = scraped(anna)).sum("lichthof_node_shots_total") > 0; }));
    CHECK(node.values.at("lichthof_node_connected") == 1);
    CHECK(node.values.at("lichthof_node_cells") == 1);
    CHECK(node.sum("lichthof_node_rays_total") > 0);
    CHECK(node.sum("lichthof_node_received_bytes_total") > 1000);

    std::set<std::string> known;
    for (const Figures& seen : {busy, node})
      for (const auto& [name, type] : seen.types) known.insert(name);
    const std::set<std::string> shown = dashboard_names();
    CHECK(shown.size() >= 10);
    for (const std::string& name : shown) CHECK_MESSAGE(known.count(name), name << " is in the dashboard alone");

    lab.node("bert").signal(SIGKILL);
    lab.node("bert").finish();
    Figures alone;
    REQUIRE(lab.until([&] { return (alone = scraped(lab.people())).sum("lichthof_lab_nodes") == 1; }));
    expect_no_counter_fell(busy, alone);
    lab.start("bert");
    REQUIRE(lab.until([&] { return scraped(lab.people()).sum("lichthof_lab_nodes") == 2; }));
    expect_no_counter_fell(alone, scraped(lab.people()));
    expect_no_counter_fell(node, scraped(anna));
    lab.asked({"jobs", "cancel", job});
    REQUIRE(lab.until(
        [&] { return scraped(lab.people()).values.count("lichthof_lab_job_progress_ratio{job=\"1\"}") == 0; }));
    REQUIRE(lab.until([&] { return scraped(anna).values.at("lichthof_node_cells") == 0; }));
    const Figures after = scraped(anna);
    expect_no_counter_fell(node, after);
  }

  TEST_CASE("figures: a node shows them where it was told to, and nothing else there") {
    LoopbackLab lab;
    Process& node = lab.start("anna", {"--metrics", "127.0.0.1:0"});
    const std::uint16_t port = figures_port(node);
    httplib::Client client("127.0.0.1", port);
    CHECK(client.Get("/")->status == 404);
    CHECK(client.Get("/v1/nodes")->status == 404);
    CHECK(client.Post("/metrics", "x", "text/plain")->status != 200);
    CHECK(client.Get("/metrics", {{"Host", "evil.example"}})->status == 403);
    CHECK(client.Get("/metrics")->status == 200);
    for (const char* wrong :
         {"", "x", "localhost", "127.0.0.1:", ":9464", "127.0.0.1:70000", "-1", "::1:9464", "a b:1"}) {
      CAPTURE(wrong);
      const Outcome outcome = ran({"node", "--join", "127.0.0.1:1", "--metrics", wrong});
      CHECK(outcome.status == 2);
      CHECK(outcome.err.find("lichthof: ") != std::string::npos);
      CHECK(outcome.err.find("--metrics") != std::string::npos);
    }
    const Outcome taken = ran({"node", "--join", "127.0.0.1:1", "--metrics", std::to_string(port)});
    CHECK(taken.status == 1);
    CHECK(taken.err.find("cannot listen") != std::string::npos);
    const Outcome open = ran({"node", "--join", "127.0.0.1:1", "--metrics", "0.0.0.0:0"});
    CHECK(open.status == 2);
    CHECK(open.err.find("--insecure") != std::string::npos);
  }

  TEST_CASE("figures: beyond loopback a node shows them to people of the lab alone") {
    const Folder folder;
    const std::string keys = folder / "keys";
    REQUIRE(actors::create_authority(keys));
    REQUIRE(actors::issue_certificate(keys, {"anna", actors::Role::node}));
    REQUIRE(actors::issue_certificate(keys, {"prometheus", actors::Role::viewer}));
    Process node({"node", "--join", "127.0.0.1:1", "--metrics", "0.0.0.0:0", "--cache", folder / "cache", "--authority",
                  keys + "/ca.crt", "--certificate", keys + "/anna.crt", "--key", keys + "/anna.key"});
    REQUIRE(node.says("/metrics"));
    const std::string text = node.said();
    std::smatch part;
    REQUIRE(std::regex_search(text, part, std::regex("figures: 0\\.0\\.0\\.0:([0-9]+)/metrics")));
    httplib::Client clear("127.0.0.1", std::stoi(part[1]));
    CHECK_FALSE(clear.Get("/metrics"));
    httplib::SSLClient viewer("127.0.0.1", std::stoi(part[1]), keys + "/prometheus.crt", keys + "/prometheus.key");
    viewer.enable_server_certificate_verification(false);
    const httplib::Result seen = viewer.Get("/metrics");
    REQUIRE(seen);
    CHECK(figures_in(seen->body).faults.empty());
    httplib::SSLClient as_node("127.0.0.1", std::stoi(part[1]), keys + "/anna.crt", keys + "/anna.key");
    as_node.enable_server_certificate_verification(false);
    const httplib::Result refused = as_node.Get("/metrics");
    REQUIRE(refused);
    CHECK(refused->status == 403);
  }
}
