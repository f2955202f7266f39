/// A lab whose machines are hosts of their own: delay on the way, cables pulled, and a network that falls apart and heals.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/system/real_lab.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

constexpr double progress_within_s = 30;  // of the moment a network heals
// As lab_test states it: the order of shots alone moves a picture by so much.
constexpr double most_difference = 5e-3;

const std::string eps = "1e-5";

std::uint64_t epoch(RealLab& lab, const std::string& id) { return lab.job(id).value("epoch", std::uint64_t{0}); }
bool is_lit(RealLab& lab, const std::string& id) {
  const nlohmann::json job = lab.job(id);
  return job.value("pass", "") == "radiosity" && job.value("shots", 0) > 0;
}

struct HostedLab : RealLab {
  HostedLab() : RealLab(Setup{.nodes = {"anna", "bert", "carl", "dora"}, .has_hosts = true}) {
    if (network()) network()->delay(20, 5);
    undisturbed = submit(eps);
    expect_done(undisturbed);
  }
  std::string submitted_and_lit() {
    const std::string id = submit(eps);
    REQUIRE(until([&] { return is_lit(*this, id) || is_over(id); }));
    return id;
  }
  void expect_same(const std::string& id) {
    expect_done(id);
    CHECK(difference(picture(id), picture(undisturbed)) < most_difference);
  }
  /// A network of hosts is what the case is about: without one there is nothing to cut but whole processes.
  std::string undisturbed;
};

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("lab network: one side of a partition goes on; all work together after it heals") {
    HostedLab lab;
    const std::string id = lab.submitted_and_lit();
    lab.cut({"carl", "dora"}, true);
    REQUIRE(lab.until([&] { return lab.node_count() == 2; }));
    lab.expect_same(id);
    const std::string other = lab.submitted_and_lit();
    lab.cut({"carl", "dora"}, false);
    const double healed = now_s();
    REQUIRE(lab.until([&] { return lab.node_count() == 4; }));
    MESSAGE("all nodes are back " << now_s() - healed << " s after healing");
    CHECK(now_s() - healed < progress_within_s);
    lab.expect_same(other);
  }

  TEST_CASE("lab network: a controller that was cut off from every node goes on when the network heals") {
    HostedLab lab;
    const std::string id = lab.submitted_and_lit();
    lab.cut({"anna", "bert", "carl", "dora"}, true);
    REQUIRE(lab.until([&] { return lab.node_count() == 0; }));
    CHECK_FALSE(lab.is_over(id));
    const std::uint64_t before = epoch(lab, id);
    lab.cut({"anna", "bert", "carl", "dora"}, false);
    const double healed = now_s();
    REQUIRE(lab.until([&] { return (epoch(lab, id) > before && is_lit(lab, id)) || lab.is_over(id); }));
    MESSAGE("progress " << now_s() - healed << " s after healing");
    CHECK(now_s() - healed < progress_within_s);
    lab.expect_same(id);
  }

  TEST_CASE("lab network: a cable that is pulled and put back costs no job") {
    HostedLab lab;
    if (!lab.network())
      return lab.expect_same(lab.submitted_and_lit());  // an interface of loopback can't be taken down
    for (const double away_s : {2.0, 9.0}) {            // shorter and longer than a node may be silent
      CAPTURE(away_s);
      const std::string id = lab.submitted_and_lit();
      lab.network()->set_link(lab.host("bert"), false);
      std::this_thread::sleep_for(std::chrono::duration<double>(away_s));
      lab.network()->set_link(lab.host("bert"), true);
      lab.expect_same(id);
      REQUIRE(lab.until([&] { return lab.node_count() == 4; }, progress_within_s));
    }
    MESSAGE(lab.network()->passed() << " packets passed, " << lab.network()->lost() << " were lost");
  }

  TEST_CASE("lab network: nodes that reach the controller but not each other do not stop a job") {
    HostedLab lab;
    const std::string id = lab.submitted_and_lit();
    if (!lab.network()) return lab.expect_same(id);  // processes of one host always reach each other
    lab.network()->set_open(lab.host("bert"), lab.host("carl"), false);
    lab.expect_same(id);
    const std::string other = lab.submitted_and_lit();
    lab.network()->set_open(lab.host("bert"), lab.host("carl"), true);
    lab.expect_same(other);
  }
}
