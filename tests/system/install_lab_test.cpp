/// deploy/install-lab with an ssh that leads to folders instead of machines: packages are unpacked, keys made and handed out,
/// and units written for real; apt-get and systemctl only note what they were asked.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <thread>

#include "actors/link/keys.hpp"
#include "actors/link/tls.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;
namespace fs = std::filesystem;

namespace {

constexpr const char* ssh = R"(#!/bin/bash
while [[ $1 == -o ]]; do shift 2; done
export HOST=$1 DESTDIR=$FAKE/$1 PATH=$FAKE/bin:$PATH
shift
echo "ssh $HOST $*" >>"$FAKE/log"
[[ ! -e $FAKE/down-$HOST ]] || { echo "ssh: connect to host $HOST port 22: No route to host" >&2; exit 255; }
mkdir -p "$DESTDIR/running" "$FAKE/running"
: >"$FAKE/running/$$"
ls "$FAKE/running" | wc -l >>"$FAKE/at-once"
trap 'rm -f "$FAKE/running/$$"' EXIT
sleep 0.05
bash -c "$*"
)";
constexpr const char* scp = R"(#!/bin/bash
while [[ $1 == -* ]]; do [[ $1 == -o ]] && shift; shift; done
cp "${@:1:$#-1}" "${@: -1:1}" 2>/dev/null || { to=${@: -1:1}; cp "${@:1:$#-1}" "${to#*:}"; }
)";
constexpr const char* apt_get = R"(#!/bin/bash
echo "$HOST apt-get $*" >>"$FAKE/log"
[[ ! -e $FAKE/broken-$HOST ]] || { echo "Reading lists..."; echo "E: Unable to locate package libembree3-3"; exit 100; }
[[ $* != *install* ]] || dpkg-deb -x "${@: -1:1}" "$DESTDIR"
)";
constexpr const char* systemctl = R"(#!/bin/bash
echo "$HOST systemctl $*" >>"$FAKE/log"
[[ $* != *is-active* || ! -e $FAKE/dead-$HOST ]]
)";

/// Machines as folders of their names, and a folder of programs that stand for what reaches them.
class FakeLab {
 public:
  FakeLab() {
    REQUIRE(::mkdir((folder_ / "bin").c_str(), 0755) == 0);
    const auto program = [&](const std::string& name, const std::string& text) {
      REQUIRE(::chmod(folder_.write("bin/" + name, text).c_str(), 0755) == 0);
    };
    program("ssh", ssh), program("scp", scp), program("apt-get", apt_get), program("systemctl", systemctl);
    program("journalctl", "#!/bin/sh\necho 'lichthof: 10.0.0.1:7411: cannot listen'\n");
    program("sudo", "#!/bin/sh\nshift 2\nexec \"$@\"\n");
    program("chown", "#!/bin/sh\necho \"$HOST chown $*\" >>\"$FAKE/log\"\n");
    // A package with the program in it and nothing else: packing a build takes its time.
    const std::string root = folder_ / "root";
    fs::create_directories(root + "/DEBIAN");
    fs::create_directories(root + "/usr/bin");
    folder_.write("root/DEBIAN/control",
                  "Package: lichthof\nVersion: 1\nArchitecture: all\nMaintainer: x\nDescription: x\n");
    fs::create_symlink(LICHTHOF_PROGRAM, root + "/usr/bin/lichthof");
    REQUIRE(std::system(("dpkg-deb --build '" + root + "' '" + package() + "' >/dev/null").c_str()) == 0);
  }
  std::string package() const { return folder_ / "small.deb"; }
  std::string operator/(const std::string& name) const { return folder_ / name; }
  bool has(const std::string& name) const { return folder_.has(name); }
  std::string text(const std::string& name) const { return contents(folder_ / name); }
  void write(const std::string& name, const std::string& text) const { folder_.write(name, text); }

  /// Calls the script. @param words  as a shell reads them
  Outcome install(const std::string& words) const {
    const std::string command = "FAKE='" + (folder_ / "") + "' LICHTHOF_SETTLE_S=0 PATH='" + (folder_ / "bin") +
                                "':$PATH bash " + LICHTHOF_SOURCE_DIR + "/deploy/install-lab " + words + " >'" +
                                (folder_ / "out") + "' 2>'" + (folder_ / "err") + "' </dev/null";
    const int status = std::system(command.c_str());
    Outcome outcome;
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.out = text("out"), outcome.err = text("err");
    return outcome;
  }
  Outcome install_small(const std::string& words) const { return install("--package " + package() + " " + words); }

  /// Who the keys of a host say that it is; they are good for a link.
  actors::Identity identity(const std::string& host, const std::string& kind) const {
    const std::string etc = folder_ / (host + "/etc/lichthof/");
    const auto tls = actors::TlsContext::load({etc + "ca.crt", etc + kind + ".crt", etc + kind + ".key"});
    if (!tls) FAIL(tls.error().text());
    return (*tls)->own();
  }
  mode_t mode(const std::string& name) const {
    struct stat facts {};
    REQUIRE(::stat((folder_ / name).c_str(), &facts) == 0);
    return facts.st_mode & 0777;
  }

 private:
  Folder folder_;
};

bool says(const Outcome& outcome, const std::string& line) {
  std::istringstream lines(outcome.out);
  for (std::string one; std::getline(lines, one);)
    if (one.find(line) != std::string::npos) return true;
  MESSAGE("none of these lines holds: " << line << "\n" << outcome.out << outcome.err);
  return false;
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("install-lab: packs the build, and leaves a controller and nodes that know each other") {
    const FakeLab lab;
    lab.write("hosts", "# the third room\n root@anna.lab.example # old\n\nbert\n");
    const Outcome outcome = lab.install("--build " LICHTHOF_BINARY_DIR " --controller srv --hosts " + (lab / "hosts") +
                                        " carl --idle-only");
    REQUIRE(outcome.status == 0);
    CHECK(says(outcome, "srv: controller runs, lichthof "));
    for (const std::string host : {"root@anna.lab.example", "bert", "carl"})
      CHECK(says(outcome, host + ": node runs, lichthof "));
    CHECK(lab.identity("srv", "controller").role == actors::Role::controller);
    for (const auto& [host, name] :
         {std::pair{"root@anna.lab.example", "anna"}, std::pair{"bert", "bert"}, std::pair{"carl", "carl"}}) {
      const std::string at = std::string(host) + "/";
      CHECK(lab.identity(host, "node").name == name);
      CHECK(lab.identity(host, "node").role == actors::Role::node);
      CHECK(lab.mode(at + "etc/lichthof/node.key") == 0600);
      CHECK(lab.mode(at + "etc/lichthof") == 0755);
      CHECK_FALSE(lab.has(at + "etc/lichthof/keys"));
      CHECK(lab.text(at + "etc/lichthof/node.conf").find("--join srv --listen 0.0.0.0 --idle-only") !=
            std::string::npos);
      CHECK(lab.has(at + "usr/lib/systemd/system/lichthof-node.service"));
      CHECK(lab.has(at + "usr/lib/sysusers.d/lichthof.conf"));
      CHECK(lab.text("log").find(std::string(host) + " systemctl restart lichthof-node.service") != std::string::npos);
    }
    CHECK(lab.mode("srv/etc/lichthof/keys") == 0700);
    CHECK(lab.mode("srv/etc/lichthof/keys/ca.key") == 0600);
    CHECK(lab.text("log").find("srv systemctl --quiet enable lichthof-controller.service") != std::string::npos);
    CHECK(lab.text("log").find("srv systemctl restart lichthof-node") == std::string::npos);

    // What it wrote is what the program takes.
    std::istringstream conf(lab.text("srv/etc/lichthof/controller.conf"));
    std::string line, mark;
    std::getline(conf, mark), std::getline(conf, line);
    REQUIRE(line.starts_with("LICHTHOF_OPTIONS="));
    std::istringstream options(line.substr(line.find('=') + 1));
    std::vector<std::string> words{"controller", "--port", "0", "--node-port", "0", "--state", lab / "state"};
    for (std::string word; options >> word;)
      words.push_back(word.starts_with("/etc/") ? lab / ("srv" + word) : word == "0.0.0.0" ? "127.0.0.1" : word);
    Process controller(words);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    controller.signal(SIGTERM);
    const Outcome ended = controller.finish();
    CHECK(ended.status == 0);
    CHECK(ended.out.find("people: https://") != std::string::npos);

    // Nothing is left on the hosts but what was installed.
    std::istringstream log(lab.text("log"));
    std::size_t made = 0, removed = 0;
    while (std::getline(log, line))
      made += line.find("mktemp -d") != std::string::npos,
          removed += line.find("rm -rf /tmp/lichthof-") != std::string::npos;
    CHECK(made == 4);
    CHECK(removed == 4);
  }

  TEST_CASE("install-lab: a second time it keeps keys and what an administrator has changed") {
    const FakeLab lab;
    REQUIRE(lab.install_small("--controller srv anna bert").status == 0);
    const std::string anna = lab.text("anna/etc/lichthof/node.crt"),
                      authority = lab.text("srv/etc/lichthof/keys/ca.crt");
    lab.write("bert/etc/lichthof/node.conf", "LICHTHOF_OPTIONS=--join elsewhere\n");
    const Outcome again = lab.install_small("--controller srv anna bert carl srv --node-options '--threads 2'");
    CHECK(again.status == 0);
    CHECK(lab.text("anna/etc/lichthof/node.crt") == anna);
    CHECK(lab.text("srv/etc/lichthof/keys/ca.crt") == authority);
    CHECK(lab.text("anna/etc/lichthof/node.conf").find("--threads 2\n") != std::string::npos);
    CHECK(lab.text("bert/etc/lichthof/node.conf") == "LICHTHOF_OPTIONS=--join elsewhere\n");
    CHECK(lab.identity("carl", "node").name == "carl");
    // A machine may be both.
    CHECK(lab.identity("srv", "node").name == "srv");
    CHECK(lab.identity("srv", "controller").name == "lab-controller");

    // A pair that has expired is made anew.
    for (const char* part : {"crt", "key"}) fs::remove(lab / (std::string("srv/etc/lichthof/keys/anna.") + part));
    REQUIRE(actors::issue_certificate(lab / "srv/etc/lichthof/keys", {"anna", actors::Role::node},
                                      {-10 * actors::day_s, -1 * actors::day_s}));
    CHECK(lab.install_small("--controller srv anna").status == 0);
    CHECK(lab.identity("anna", "node").name == "anna");
  }

  TEST_CASE("install-lab: one clear line for each host that fails, and the others are installed") {
    const FakeLab lab;
    for (const char* trouble : {"down-anna", "broken-bert", "dead-carl"}) lab.write(trouble, "");
    const Outcome outcome = lab.install_small("--controller srv anna bert carl dora");
    CHECK(outcome.status == 1);
    CHECK(says(outcome, "anna: FAILED: can not be reached: ssh: connect to host anna port 22: No route to host"));
    CHECK(says(outcome, "bert: FAILED: not installed: the package can not be installed: E: Unable to locate package"));
    CHECK(says(outcome,
               "carl: FAILED: not started: lichthof-node.service does not run: lichthof: 10.0.0.1:7411: cannot"));
    CHECK(says(outcome, "dora: node runs"));
    CHECK(outcome.err == "install-lab: 3 of 5 hosts failed\n");
    CHECK(std::count(outcome.out.begin(), outcome.out.end(), '\n') == 5);
    lab.write("down-srv", "");
    const Outcome headless = lab.install_small("--controller srv dora");
    CHECK(headless.status == 1);
    CHECK(says(headless, "srv: FAILED: can not be reached"));
    CHECK(headless.out.find("dora: node runs") == std::string::npos);
  }

  TEST_CASE("install-lab: so many hosts at a time as was said, and none when it is only asked what it would do") {
    const FakeLab lab;
    std::string hosts;
    for (int k = 0; k < 9; ++k) hosts += " n" + std::to_string(k);
    const Outcome dry = lab.install_small("--controller srv --dry-run" + hosts);
    CHECK(dry.status == 0);
    CHECK(says(dry, "n8: would get the keys of n8, and start lichthof-node --join srv"));
    CHECK_FALSE(lab.has("log"));
    CHECK(lab.install_small("--controller srv --jobs 3" + hosts).status == 0);
    std::istringstream counts(lab.text("at-once"));
    int most = 0;
    for (int count = 0; counts >> count;) most = std::max(most, count);
    // A node's keys come over two connections at once.
    CHECK(most > 1);
    CHECK(most <= 6);
  }

  TEST_CASE("install-lab: bad usage is one line and changes nothing") {
    const FakeLab lab;
    for (const auto& [words, part] :
         {std::pair{"anna", "--controller"}, std::pair{"--controller", "needs a value"},
          std::pair{"--controller srv --frobnicate", "--frobnicate"}, std::pair{"--controller srv --jobs many", "many"},
          std::pair{"--controller srv --hosts /nowhere", "/nowhere"}, std::pair{"--controller 'srv;reboot'", "no host"},
          std::pair{"--controller srv -- '-oProxyCommand=x'", "unknown option"},
          std::pair{"--controller srv anna.a anna.b", "would both be called anna"},
          std::pair{"--controller srv anna --node-options '$(reboot)'", "--node-options"},
          std::pair{"--controller srv --build /nowhere anna", "/nowhere: no build"}}) {
      CAPTURE(words);
      const Outcome outcome = lab.install(words);
      CHECK(outcome.status == 2);
      CHECK(outcome.err.starts_with("install-lab: "));
      CHECK(outcome.err.find(part) != std::string::npos);
      CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    }
    CHECK_FALSE(lab.has("log"));
    CHECK(says(lab.install("--help"), "--controller HOST"));
  }
}
