#include "actors/link/keys.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "actors/link/tls.hpp"
#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::actors;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

namespace {

mode_t mode_of(const std::string& path) {
  struct stat facts = {};
  ::stat(path.c_str(), &facts);
  return facts.st_mode & 07777;
}

/// A folder with an authority and a node.
struct Lab {
  Lab() {
    REQUIRE(create_authority(keys));
    REQUIRE(issue_certificate(keys, {"node1", Role::node}));
  }
  ScratchFolder folder;
  std::string keys = folder / "keys";
  std::string file(const std::string& name) const { return keys + "/" + name; }
  TlsFiles files(const std::string& name) const { return {file("ca.crt"), file(name + ".crt"), file(name + ".key")}; }
};

}  // namespace

TEST_SUITE("actors") {
  TEST_CASE("keys: an authority issues certificates that say name and role") {
    const Lab lab;
    const auto facts = certificate_facts(lab.keys);
    REQUIRE(facts);
    REQUIRE(facts->size() == 2);
    CHECK((*facts)[0].role == "authority");
    CHECK((*facts)[1].name == "node1");
    CHECK((*facts)[1].role == "node");
    CHECK((*facts)[1].issuer == (*facts)[0].name);
    CHECK((*facts)[1].problem.empty());
    CHECK((*facts)[1].fingerprint.size() == 64);
    CHECK(mode_of(lab.file("ca.key")) == 0600);
    CHECK(mode_of(lab.file("node1.key")) == 0600);
    CHECK(mode_of(lab.file("node1.crt")) == 0644);
    const auto tls = TlsContext::load(lab.files("node1"));
    REQUIRE(tls);
    CHECK((*tls)->own().name == "node1");
    CHECK((*tls)->own().role == Role::node);
  }

  TEST_CASE("keys: nothing is overwritten, and nothing half done is left") {
    const Lab lab;
    const std::string before = lab.folder.read("keys/node1.crt");
    check_error(create_authority(lab.keys), lab.file("ca.crt"), "exists already");
    check_error(issue_certificate(lab.keys, {"node1", Role::user}), lab.file("node1.crt"), "exists already");
    CHECK(lab.folder.read("keys/node1.crt") == before);
    lab.folder.write("keys/lone.key", "x");
    check_error(issue_certificate(lab.keys, {"lone", Role::user}), lab.file("lone.key"), "exists already");
    std::error_code none;
    CHECK_FALSE(std::filesystem::exists(lab.file("lone.crt"), none));
  }

  TEST_CASE("keys: what is revoked says so, opens nothing, and makes room for a successor") {
    const Lab lab, foreign;
    REQUIRE(issue_certificate(lab.keys, {"node2", Role::node}));
    const auto facts_of = [&](const std::string& name) { return certificate_facts(lab.file(name + ".crt"))->front(); };
    const std::string before = facts_of("node1").fingerprint;
    REQUIRE(revoke_certificate(lab.keys, "node1"));
    CHECK(mode_of(lab.file("ca.crl")) == 0644);
    CHECK(facts_of("node1").problem == "revoked");
    CHECK(facts_of("node2").problem.empty());
    check_error(TlsContext::load(lab.files("node1")), lab.file("node1.crt"), "has been revoked");
    CHECK(TlsContext::load(lab.files("node2")));
    check_error(revoke_certificate(lab.keys, "node1"), lab.file("node1.crt"), "revoked already");
    REQUIRE(issue_certificate(lab.keys, {"node1", Role::node}));
    CHECK(facts_of("node1").fingerprint != before);
    CHECK(facts_of("node1").problem.empty());
    CHECK(TlsContext::load(lab.files("node1")));
    // The list keeps what was in it.
    REQUIRE(revoke_certificate(lab.keys, "node2"));
    REQUIRE(revoke_certificate(lab.keys, "node1"));
    CHECK(facts_of("node1").problem == "revoked");
    CHECK(facts_of("node2").problem == "revoked");

    check_error(revoke_certificate(lab.keys, "nobody"), lab.file("nobody.crt"), "No such file");
    check_error(revoke_certificate(lab.keys, "ca"), "ca", "no name of a certificate");
    check_error(revoke_certificate(lab.folder / "none", "node1"), lab.folder / "none/ca.crt", "keys init");
    std::filesystem::copy_file(foreign.file("node1.crt"), lab.file("node3.crt"));
    check_error(revoke_certificate(lab.keys, "node3"), lab.file("node3.crt"), "no certificate of the authority");
  }

  TEST_CASE("keys: what can not be done is one clear line") {
    const Lab lab;
    check_error(issue_certificate(lab.keys, {"../evil", Role::node}), "../evil", "a name has");
    check_error(issue_certificate(lab.keys, {"ca", Role::node}), "ca", "a name has");
    check_error(issue_certificate(lab.folder / "none", {"x", Role::node}), lab.folder / "none/ca.crt", "keys init");
    check_error(create_authority(lab.folder / "no/such"), lab.folder / "no/such", "No such file");
    check_error(certificate_facts(lab.folder / "none"), lab.folder / "none", "No such file");
    check_error(certificate_facts(lab.folder / "."), lab.folder / ".", "no .crt");
    check_error(certificate_facts(lab.file("node1.key")), lab.file("node1.key"), "no certificate");
  }

  TEST_CASE("tls: every fault of its files is told at the start") {
    const Lab lab, foreign;
    const TlsFiles good = lab.files("node1");
    const auto with = [&](auto change) {
      TlsFiles files = good;
      change(files);
      return TlsContext::load(files);
    };
    check_error(with([&](TlsFiles& f) { f.authority = lab.file("no.crt"); }), lab.file("no.crt"), "No such file");
    check_error(with([&](TlsFiles& f) { f.certificate = lab.file("no.crt"); }), lab.file("no.crt"), "No such file");
    check_error(with([&](TlsFiles& f) { f.key = lab.file("no.key"); }), lab.file("no.key"), "No such file");
    check_error(with([&](TlsFiles& f) { f.key = foreign.file("node1.key"); }), foreign.file("node1.key"),
                "not the key");
    check_error(with([&](TlsFiles& f) { f.authority = foreign.file("ca.crt"); }), lab.file("node1.crt"), "not valid");
    check_error(with([&](TlsFiles& f) { f.certificate = f.key; }), lab.file("node1.key"), "no certificate");
    check_error(with([&](TlsFiles& f) { f.certificate = f.authority, f.key = lab.file("ca.key"); }), lab.file("ca.crt"),
                "no role");
    REQUIRE(issue_certificate(lab.keys, {"old", Role::node}, {-2 * day_s, -day_s}));
    check_error(TlsContext::load(lab.files("old")), lab.file("old.crt"), "expired");
    REQUIRE(issue_certificate(lab.keys, {"early", Role::node}, {day_s, 2 * day_s}));
    check_error(TlsContext::load(lab.files("early")), lab.file("early.crt"), "not yet valid");
    ::chmod(good.key.c_str(), 0640);
    check_error(TlsContext::load(good), good.key, "chmod 600");
  }
}
