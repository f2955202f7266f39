/// The commands that speak to a cluster, as processes, to a desk with a toy lab behind it.
#include <doctest/doctest.h>
#include <signal.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "actors/link/keys.hpp"
#include "apps/cluster/desk.hpp"
#include "io/scene_bytes.hpp"
#include "tests/support/toy_lab.hpp"
#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

/// A desk, and surroundings in which commands find it: the variable and the config file of this process are the test's own.
struct Cluster {
  explicit Cluster(apps::DeskOptions options = {}) {
    options.port = 0;
    auto opened = apps::Desk::open(std::move(options), lab);
    REQUIRE(opened);
    desk = std::move(*opened);
    name = "127.0.0.1:" + std::to_string(desk->port());
    ::setenv("LICHTHOF_CLUSTER", name.c_str(), 1);
    ::setenv("XDG_CONFIG_HOME", (home / "config").c_str(), 1);
  }
  ~Cluster() {
    ::unsetenv("LICHTHOF_CLUSTER");
    ::unsetenv("XDG_CONFIG_HOME");
  }
  Folder home;
  ToyLab lab;
  std::unique_ptr<apps::Desk> desk;
  std::string name;
};

bool says(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_SUITE("cluster commands") {
  TEST_CASE("cluster commands: each has help with examples and the shared options") {
    for (const std::string command : {"jobs", "submit", "top", "shell"}) {
      const Outcome help = ran({command, "--help"});
      CHECK(help.status == 0);
      for (const char* part : {"Examples:", "--cluster", "--json", "--quiet", "--insecure"}) says(help.out, part);
    }
  }

  TEST_CASE("jobs: lists, tells about one, cancels and resumes") {
    Cluster cluster;
    CHECK(ran({"jobs"}).out == "no jobs\n");
    cluster.lab.add_job("running");
    const Outcome list = ran({"jobs"});
    CHECK(list.status == 0);
    says(list.out, "ID  STATE");
    says(list.out, "a room");
    CHECK(ran({"jobs", "--json"}).json()["jobs"].size() == 1);
    says(ran({"jobs", "1"}).out, "state         running");
    CHECK(ran({"jobs", "1", "--json"}).json()["job"]["id"] == 1);
    const Outcome cancelled = ran({"jobs", "cancel", "1"});
    CHECK(cancelled.status == 0);
    CHECK(cancelled.out == "job 1 is cancelled\n");
    CHECK(cluster.lab.state(1) == "cancelled");
    CHECK(ran({"jobs", "resume", "1", "--json"}).json()["action"] == "resume");
    CHECK(cluster.lab.state(1) == "running");
    const Outcome log = ran({"jobs", "log", "1"});
    says(log.out, "it began\nit went ?[31mon\n");
    const Outcome none = ran({"jobs", "7"});
    CHECK(none.status == 2);
    CHECK(none.complains("there is no such job"));
    CHECK(ran({"jobs", "x"}).status == 2);
    CHECK(ran({"jobs", "frobnicate", "1"}).status == 2);
    REQUIRE(cluster.lab.move(1, "done"));
    const Outcome late = ran({"jobs", "resume", "1"});
    CHECK(late.status == 1);
    CHECK(late.complains("nothing is left to resume"));
  }

  TEST_CASE("jobs: watches to the end, and fetches results whole or not at all") {
    Cluster cluster;
    cluster.lab.add_job("running");
    {
      Process watching({"jobs", "watch", "1"});
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
      REQUIRE(cluster.lab.move(1, "done"));
      const Outcome outcome = watching.finish();
      CHECK(outcome.status == 0);
      says(outcome.out, "job 1 is done");
    }
    cluster.lab.add_job("running");
    REQUIRE(cluster.lab.move(2, "failed", "node lab7 was lost"));
    const Outcome failed = ran({"jobs", "watch", "2"});
    CHECK(failed.status == 1);
    CHECK(failed.complains("failed: node lab7 was lost"));
    cluster.lab.add_job("running");
    {
      const int looks = cluster.lab.looks;
      Process watching({"jobs", "watch", "3"});
      while (cluster.lab.looks == looks) std::this_thread::sleep_for(std::chrono::milliseconds(10));
      watching.signal(SIGINT);
      const Outcome outcome = watching.finish();
      CHECK(outcome.status == 1);
      CHECK(outcome.seconds < 5);
      CHECK(outcome.complains("job 3 runs on"));
      CHECK(cluster.lab.state(3) == "running");
    }
    const Folder folder;
    cluster.lab.result_padding = 3000000;
    const Outcome fetched = ran({"jobs", "result", "1", "-o", folder / "a.exr", "--json"});
    CHECK(fetched.json()["bytes"] == 3000009);
    CHECK(contents(folder / "a.exr").starts_with("image.exr!"));
    CHECK(ran({"jobs", "result", "3", "-o", folder / "b.png"}).complains("the job is not done"));
    CHECK(ran({"jobs", "result", "1", "-o", folder / "b.gif"}).status == 2);
    CHECK(ran({"jobs", "result", "1", "-o", folder / "none/b.png"}).status == 1);
    CHECK_FALSE(folder.has("b.png"));
  }

  TEST_CASE("submit: the scene goes over once, the job with its options, and the result comes back") {
    Cluster cluster;
    const Folder folder;
    write_room(folder);
    const Outcome first = ran({"submit", folder / "room.toml"});
    INFO(first.err);
    CHECK(first.status == 0);
    CHECK(first.out == "1\n");
    CHECK(cluster.lab.uploads == 1);
    const Expected<Scene> scene = io::scene_from_parcel(cluster.lab.scenes.begin()->second, "parcel");
    REQUIRE(scene);
    CHECK(scene->surfaces.size() == 12);
    const Outcome second = ran({"submit",     folder / "room.toml",
                                "-o",         folder / "room.png",
                                "--camera",   "window",
                                "--size",     "80x60",
                                "--cells",    "2x1",
                                "--eps",      "1e-3",
                                "--patch",    "0.5",
                                "--elements", "900",
                                "--samples",  "9",
                                "--method",   "radiosity",
                                "--title",    "the room",
                                "--json"});
    INFO(second.err);
    CHECK(second.status == 0);
    CHECK(second.json()["id"] == 2);
    CHECK(second.json()["output"] == folder / "room.png");
    CHECK(contents(folder / "room.png") == "image.png");
    CHECK(cluster.lab.uploads == 1);
    const nlohmann::json spec = cluster.lab.last_spec;
    CHECK(spec["title"] == "the room");
    CHECK(spec["options"]["camera"]["eye"] == nlohmann::json({0.2, 2.8, 1.7}));
    CHECK(spec["options"]["camera"]["fov_deg"] == 70);
    CHECK(spec["options"]["width"] == 80);
    CHECK(spec["options"]["cells"] == "2x1");
    CHECK(spec["options"]["eps"] == 1e-3);
    CHECK(spec["options"]["patch_m"] == 0.5);
    CHECK(spec["options"]["elements"] == 900);
    CHECK(spec["options"]["samples"] == 9);
    CHECK(spec["options"]["method"] == "radiosity");
  }

  TEST_CASE("submit: what is wrong is said here, before anything is sent") {
    Cluster cluster;
    const Folder folder;
    write_room(folder);
    CHECK(ran({"submit", folder / "none.obj"}).status == 2);
    CHECK(ran({"submit", folder / "room.obj", "--size", "0x0"}).status == 2);
    CHECK(ran({"submit", folder / "room.toml", "--camera", "nobody"}).complains("nobody"));
    CHECK(ran({"submit", folder / "room.obj", "-o", folder / "room.gif"}).status == 2);
    folder.write("dark.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    CHECK(ran({"submit", folder / "dark.obj"}).complains("no luminaire"));
    CHECK(cluster.lab.uploads == 0);
    cluster.lab.start_state = "running";
    Process waiting({"submit", folder / "room.obj", "--wait"});
    for (int i = 0; i < 500 && cluster.lab.state(1).empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    waiting.signal(SIGINT);
    const Outcome left = waiting.finish();
    CHECK(left.status == 1);
    CHECK(left.complains("job 1 runs on"));
    CHECK(cluster.lab.state(1) == "running");
  }

  TEST_CASE("top: off a terminal it prints lines, or documents") {
    Cluster cluster;
    const Outcome lines = ran({"top"});
    CHECK(lines.status == 0);
    says(lines.out, "2 nodes [##########          ] busy, 2.5M rays/s");
    says(lines.out, "worker 1");
    CHECK(ran({"top", "--json"}).json()["actors"].size() == 2);
    const Outcome many = ran({"top", "--json", "--count", "3", "--every", "0.1"});
    CHECK(std::count(many.out.begin(), many.out.end(), '\n') == 3);
    CHECK(nlohmann::json::parse(many.out.substr(0, many.out.find('\n')))["nodes"].size() == 2);
  }

  TEST_CASE("shell: commands from the line and from a script; the first error ends a script") {
    Cluster cluster;
    cluster.lab.add_job("running");
    const Outcome two = ran({"shell", "-c", "nodes; jobs 1; drain lab1; methods; help kick"});
    INFO(two.err);
    CHECK(two.status == 0);
    for (const char* part : {"lab2", "running", "lab1 gets no new work", "two-pass", "kick NODE"}) says(two.out, part);
    CHECK(cluster.lab.drained.count("lab1") == 1);
    const Folder folder;
    write_room(folder);
    Surroundings script;
    script.stdin_from = folder.write("script", "# an evening\ndrain lab1 off\nsubmit " + (folder / "room.obj") +
                                                   " --title night\n\ncancel 1\nquit\nfrobnicate\n");
    const Outcome good = ran({"shell"}, script);
    INFO(good.err);
    CHECK(good.status == 0);
    CHECK(cluster.lab.drained.empty());
    CHECK(cluster.lab.state(1) == "cancelled");
    CHECK(cluster.lab.last_spec["title"] == "night");
    script.stdin_from = folder.write("script", "nodes\nfrobnicate\ndrain lab1\n");
    const Outcome bad = ran({"shell"}, script);
    CHECK(bad.status == 2);
    CHECK(bad.complains("line:2: there is no command 'frobnicate'"));
    CHECK(cluster.lab.drained.empty());
    cluster.lab.add_job("done");
    const Outcome failed = ran({"shell", "-c", "resume 2; resume 3"});
    CHECK(failed.status == 1);
    CHECK(ran({"shell", "-c", "submit"}).status == 2);
    CHECK(ran({"shell", "-c", "submit none.obj --frobnicate"}).status == 2);
    CHECK(ran({"shell", "-c", "jobs", "--json"}).json()["jobs"].size() == 3);
  }

  TEST_CASE("cluster commands: which cluster is meant, and clear words when there is none") {
    Cluster cluster;
    ::setenv("LICHTHOF_CLUSTER", "127.0.0.1:1", 1);
    const Outcome nobody = ran({"jobs"});
    CHECK(nobody.status == 1);
    CHECK(nobody.complains("127.0.0.1:1: no controller answers"));
    CHECK(ran({"jobs", "--cluster", cluster.name}).status == 0);
    ::setenv("LICHTHOF_CLUSTER", "", 1);
    CHECK(ran({"jobs"}).complains("no cluster is named"));
    CHECK(ran({"jobs", "--cluster", "a b"}).complains("HOST:PORT was expected"));
    CHECK(ran({"jobs", "--cluster", "lab.invalid:7410"}).complains("certificates are needed"));
    ::setenv("XDG_CONFIG_HOME", (cluster.home / "c").c_str(), 1);
    REQUIRE(::system(("mkdir -p " + (cluster.home / "c") + "/lichthof").c_str()) == 0);
    cluster.home.write("c/lichthof/config.toml", "cluster = \"" + cluster.name + "\"\n");
    CHECK(ran({"jobs"}).status == 0);
    cluster.home.write("c/lichthof/config.toml", "cluster = 3\n");
    CHECK(ran({"jobs"}).complains("config.toml:1: cluster is no text"));
    cluster.home.write("c/lichthof/config.toml", "\nclutter = \"x\"\n");
    CHECK(ran({"jobs"}).complains("config.toml:2: 'clutter' is none of"));
    cluster.home.write("c/lichthof/config.toml", "= =\n");
    CHECK(ran({"jobs"}).status == 2);
  }

  TEST_CASE("cluster commands: with certificates of the lab, from the config file or the command line") {
    Folder folder;
    const std::string keys = folder / "keys";
    REQUIRE(actors::create_authority(keys));
    for (const auto& [name, role] : {std::pair{"controller", actors::Role::controller},
                                     {"anna", actors::Role::user},
                                     {"guest", actors::Role::viewer}})
      REQUIRE(actors::issue_certificate(keys, {name, role}));
    const auto tls = actors::TlsContext::load({keys + "/ca.crt", keys + "/controller.crt", keys + "/controller.key"});
    REQUIRE(tls);
    apps::DeskOptions options;
    options.tls = *tls;
    Cluster cluster(options);
    cluster.lab.add_job("running");
    const auto as = [&](const std::string& name, std::vector<std::string> words) {
      for (const std::string& word : {std::string("--authority"), keys + "/ca.crt", std::string("--certificate"),
                                      keys + "/" + name + ".crt", std::string("--key"), keys + "/" + name + ".key"})
        words.push_back(word);
      return ran(words);
    };
    CHECK(as("anna", {"jobs"}).status == 0);
    CHECK(as("guest", {"jobs"}).status == 0);
    CHECK(as("guest", {"jobs", "cancel", "1"}).complains("a viewer may look"));
    CHECK(as("anna", {"jobs", "cancel", "1"}).status == 0);
    CHECK(as("nobody", {"jobs"}).status == 2);
    CHECK(ran({"jobs"}).complains("certificates are needed"));
    REQUIRE(::system(("mkdir -p " + (cluster.home / "config") + "/lichthof").c_str()) == 0);
    cluster.home.write("config/lichthof/config.toml", "authority = \"" + keys + "/ca.crt\"\ncertificate = \"" + keys +
                                                          "/anna.crt\"\nkey = \"" + keys + "/anna.key\"\n");
    CHECK(ran({"jobs"}).status == 0);
  }
}
