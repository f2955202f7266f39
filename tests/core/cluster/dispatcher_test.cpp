#include "core/cluster/dispatcher.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <utility>

using namespace lichthof;

namespace {

constexpr std::uint64_t megabyte = 1'000'000;
constexpr Instant at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

NodeFacts facts(const std::string& name, std::uint64_t memory_bytes = 100 * megabyte, double rays_per_s = 1e6) {
  return {name, 4, memory_bytes, rays_per_s};
}

/// Two cells of 10 MB each.
JobWish wish(bool radiosity = true, bool picture = false) {
  JobWish wish;
  wish.title = "a room";
  wish.radiosity = radiosity;
  wish.picture = picture;
  wish.grid = {2, 1, 1};
  wish.patches = {1000, 1000};
  wish.bytes_per_patch = 10'000;
  return wish;
}

template <class T>
std::vector<T> given(const Dispatched& dispatched) {
  std::vector<T> found;
  for (const Order& order : dispatched.orders)
    if (const auto* one = std::get_if<T>(&order)) found.push_back(*one);
  return found;
}

/// A lab that keeps its journal and remembers what was hosted last.
struct Lab {
  Dispatcher dispatcher;
  std::vector<JournalEntry> journal;
  Dispatched last;
  Instant now;

  explicit Lab(const DispatcherOptions& options = {}) : dispatcher(options) {}
  const Dispatched& step(double seconds) {
    now = at(seconds);
    for (const auto& [id, node] : std::map(dispatcher.nodes())) dispatcher.node_reported(id, memory_left(id), now);
    return step();
  }
  const Dispatched& step() {
    last = dispatcher.step(now);
    journal.insert(journal.end(), last.records.begin(), last.records.end());
    return last;
  }
  std::uint64_t memory_left(NodeId id) const {
    return dispatcher.nodes().at(id).facts.memory_bytes - dispatcher.booked_bytes(id);
  }
  void join(std::uint32_t id, const NodeFacts& node) { dispatcher.node_joined(NodeId{id}, node, now); }
  /// Every node that the present epoch of a job awaits says that it hosts its share.
  const Dispatched& host_all(JobId job) {
    const HostedPass run = *dispatcher.jobs().at(job).run;
    for (const auto& [node, share] : run.shares) dispatcher.hosted(node, job, run.epoch, now);
    return step();
  }
  const LabJob& job(JobId id) const { return dispatcher.jobs().at(id); }
  void restart() {
    auto restored = Dispatcher::restored(dispatcher.options(), journal);
    REQUIRE(restored);
    dispatcher = *std::move(restored);
  }
};

/// A lab of two nodes in which one job runs.
struct RunningLab : Lab {
  JobId id;
  explicit RunningLab(const JobWish& what = wish(), const DispatcherOptions& options = {}) : Lab(options) {
    join(1, facts("a"));
    join(2, facts("b"));
    id = *dispatcher.submit(what, now);
    step();
    host_all(id);
    REQUIRE(job(id).run->begun);
  }
  Epoch epoch() const { return job(id).epoch; }
};

}  // namespace

TEST_SUITE("dispatcher") {
  TEST_CASE("dispatcher: a job is hosted under a fresh epoch, begins when all have said so, and ends once") {
    Lab lab;
    lab.join(1, facts("a"));
    lab.join(2, facts("b"));
    const JobId id = *lab.dispatcher.submit(wish(true, true), lab.now);
    CHECK(lab.dispatcher.has_work(lab.now));
    lab.step();
    auto hosts = given<HostRun>(lab.last);
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].epoch == Epoch{1});
    CHECK(!hosts[0].from_checkpoint);
    REQUIRE(hosts[0].cells.size() == 2);
    CHECK(!lab.dispatcher.has_work(lab.now));
    lab.dispatcher.hosted(NodeId{1}, id, Epoch{1}, lab.now);
    lab.dispatcher.hosted(NodeId{1}, id, Epoch{1}, lab.now);
    CHECK(given<BeginPass>(lab.step()).empty());
    lab.dispatcher.pass_finished(id, Epoch{1}, lab.now);  // it has not begun
    lab.dispatcher.hosted(NodeId{2}, id, Epoch{1}, lab.now);
    CHECK(given<BeginPass>(lab.step()).size() == 1);

    lab.dispatcher.pass_finished(id, Epoch{1}, lab.now);
    lab.step();
    CHECK(given<ReleaseRun>(lab.last).size() == 1);
    hosts = given<HostRun>(lab.last);
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].pass == Pass::picture);
    CHECK(hosts[0].epoch == Epoch{2});
    CHECK(hosts[0].workers.size() == 2);
    CHECK(hosts[0].workers[0].second == 4);
    CHECK(lab.host_all(id).orders.size() == 1);
    lab.dispatcher.pass_finished(id, Epoch{1}, lab.now);  // of the pass before
    CHECK(lab.step().orders.empty());
    lab.dispatcher.pass_finished(id, Epoch{2}, lab.now);
    lab.dispatcher.pass_finished(id, Epoch{2}, lab.now);
    lab.step();
    REQUIRE(given<JobEnded>(lab.last).size() == 1);
    CHECK(given<JobEnded>(lab.last)[0].state == JobState::done);
    CHECK(lab.dispatcher.booked_bytes(NodeId{1}) == 0);
  }

  TEST_CASE("dispatcher: jobs run by priority, then by submission, as many side by side as allowed") {
    DispatcherOptions options;
    options.most_running_jobs = 2;
    Lab lab(options);
    const JobId first = *lab.dispatcher.submit(wish(), lab.now);
    const JobId second = *lab.dispatcher.submit(wish(), lab.now);
    JobWish urgent = wish();
    urgent.priority = 5;
    const JobId third = *lab.dispatcher.submit(urgent, lab.now);
    CHECK(lab.step().orders.empty());
    CHECK(lab.job(first).reason == "waits for a node: none is there");
    lab.join(1, facts("a"));
    lab.step();
    CHECK(lab.job(third).state == JobState::running);
    CHECK(lab.job(first).state == JobState::running);
    CHECK(lab.job(second).reason == "waits, 2 jobs are running");
    REQUIRE(lab.dispatcher.cancel(third, lab.now));
    lab.step();
    CHECK(lab.job(second).state == JobState::running);
  }

  TEST_CASE("dispatcher: memory is booked, and who waits for that of others is not overtaken") {
    Lab lab;
    lab.join(1, facts("a", 30 * megabyte));
    const JobId first = *lab.dispatcher.submit(wish(), lab.now);   // 20 MB
    const JobId second = *lab.dispatcher.submit(wish(), lab.now);  // 20 MB
    JobWish tiny = wish();
    tiny.bytes_per_patch = 1000;
    const JobId third = *lab.dispatcher.submit(tiny, lab.now);  // 2 MB: it would fit
    lab.step();
    CHECK(lab.dispatcher.booked_bytes(NodeId{1}) == 20 * megabyte);
    CHECK(lab.job(second).reason.starts_with("waits for memory that other jobs hold: 2 cells need 20 MB"));
    CHECK(lab.job(third).reason == "waits behind job 2");
    REQUIRE(lab.dispatcher.cancel(first, lab.now));
    lab.step();
    CHECK(lab.job(second).state == JobState::running);
    CHECK(lab.job(third).state == JobState::running);
  }

  TEST_CASE("dispatcher: what the whole lab could not hold lets others pass, and fails when patience ends") {
    Lab lab;
    lab.join(1, facts("a", 15 * megabyte));
    const JobId big = *lab.dispatcher.submit(wish(), lab.now);
    JobWish tiny = wish();
    tiny.bytes_per_patch = 1000;
    const JobId small = *lab.dispatcher.submit(tiny, lab.now);
    lab.step();
    CHECK(lab.job(small).state == JobState::running);
    CHECK(lab.job(big).reason.starts_with("waits for more nodes, the lab can not hold it"));
    for (int t = 5; t < 60; t += 5) lab.step(t);
    CHECK(lab.job(big).state == JobState::queued);
    lab.step(60);
    CHECK(lab.job(big).state == JobState::failed);
    CHECK(lab.job(big).reason.starts_with("the lab can not hold it: 2 cells need 20 MB"));
    lab.join(2, facts("b", 15 * megabyte));
    REQUIRE(lab.dispatcher.retry(big, lab.now));
    lab.step();
    CHECK(lab.job(big).state == JobState::running);
  }

  TEST_CASE("dispatcher: memory that other programs use is not counted on") {
    Lab lab;
    lab.join(1, facts("a", 30 * megabyte));
    lab.dispatcher.node_reported(NodeId{1}, 12 * megabyte, lab.now);
    const JobId id = *lab.dispatcher.submit(wish(), lab.now);
    lab.step();
    CHECK(lab.job(id).reason.starts_with("waits for draining nodes, or for memory other programs use"));
    lab.dispatcher.node_reported(NodeId{1}, 25 * megabyte, lab.now);
    lab.step();
    CHECK(lab.job(id).state == JobState::running);
  }

  TEST_CASE("dispatcher: radiosity that loses a node goes on from its checkpoint under a new epoch") {
    RunningLab lab;
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.step();
    lab.dispatcher.node_left(NodeId{1}, "connection lost", lab.now);
    lab.step();
    REQUIRE(lab.last.orders.size() == 2);
    CHECK(std::get<ReleaseRun>(lab.last.orders[0]).epoch == Epoch{1});
    const auto& host = std::get<HostRun>(lab.last.orders[1]);
    CHECK(host.epoch == Epoch{2});
    CHECK(host.from_checkpoint);
    REQUIRE(host.cells.size() == 1);
    CHECK(host.cells[0] == std::pair{NodeId{2}, std::vector{CellId{0}, CellId{1}}});
    // Late messages of the old epoch change nothing.
    lab.dispatcher.hosted(NodeId{2}, lab.id, Epoch{1}, lab.now);
    lab.dispatcher.pass_finished(lab.id, Epoch{1}, lab.now);
    lab.dispatcher.pass_failed(lab.id, Epoch{1}, "late", lab.now);
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.dispatcher.host_failed(NodeId{2}, lab.id, Epoch{1}, "late", lab.now);
    CHECK(lab.step().orders.empty());
    // Without any node it waits.
    lab.dispatcher.node_left(NodeId{2}, "connection lost", lab.now);
    CHECK(given<HostRun>(lab.step()).empty());
    CHECK(lab.job(lab.id).state == JobState::queued);
    lab.join(3, facts("c"));
    CHECK(given<HostRun>(lab.step()).size() == 1);
  }

  TEST_CASE("dispatcher: a node silent for a lease is dropped; one that reports is not") {
    RunningLab lab;
    for (int t = 1; t <= 9; ++t) {
      lab.now = at(t);
      lab.dispatcher.node_reported(NodeId{1}, 50 * megabyte, lab.now);
      lab.step();
      CHECK(given<DropNode>(lab.last).empty());
      REQUIRE(lab.last.wake_at);
    }
    lab.now = at(10);
    CHECK(lab.dispatcher.has_work(lab.now));
    lab.step();
    REQUIRE(given<DropNode>(lab.last).size() == 1);
    CHECK(given<DropNode>(lab.last)[0].node == NodeId{2});
    CHECK(given<DropNode>(lab.last)[0].reason == "silent for 10 s");
    CHECK(given<HostRun>(lab.last).size() == 1);
  }

  TEST_CASE("dispatcher: a dispatcher that slept itself does not take silence for death") {
    RunningLab lab;
    lab.now = at(100);
    CHECK(given<DropNode>(lab.step()).empty());
    lab.now = at(110);
    CHECK(given<DropNode>(lab.step()).size() == 2);
  }

  TEST_CASE("dispatcher: a node that leaves by itself is no node that its job killed") {
    RunningLab lab;
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.step();
    NodeId host{1}, other{2};
    for (std::uint32_t round = 0; round < 5; ++round) {
      lab.dispatcher.node_parted(host, "its owner is at the machine", lab.now);
      lab.dispatcher.node_parted(host, "twice", lab.now);
      const auto hosts = given<HostRun>(lab.step());
      REQUIRE(hosts.size() == 1);
      CHECK(hosts[0].from_checkpoint);
      REQUIRE(hosts[0].cells.size() == 1);
      CHECK(hosts[0].cells[0].first == other);
      CHECK(given<DropNode>(lab.last).empty());
      lab.host_all(lab.id);
      // It comes back, and gets work again with the next epoch.
      host = std::exchange(other, NodeId{11 + round});
      lab.join(other.value, facts("a"));
      lab.step();
    }
    CHECK(lab.job(lab.id).lost_nodes.empty());
    CHECK(lab.job(lab.id).state == JobState::running);
    lab.dispatcher.node_left(host, "connection lost", lab.now);
    lab.step();
    CHECK(lab.job(lab.id).lost_nodes == std::vector<std::string>{"a"});
  }

  TEST_CASE("dispatcher: the picture goes on without a lost node, and waits when none is left") {
    RunningLab lab(wish(false, true));
    lab.dispatcher.node_left(NodeId{1}, "gone", lab.now);
    CHECK(lab.step().orders.empty());
    CHECK(lab.epoch() == Epoch{1});
    lab.dispatcher.node_left(NodeId{2}, "gone", lab.now);
    CHECK(given<ReleaseRun>(lab.step()).size() == 1);
    CHECK(lab.job(lab.id).state == JobState::queued);
    lab.join(3, facts("c"));
    const auto hosts = given<HostRun>(lab.step());
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].epoch == Epoch{2});
  }

  TEST_CASE("dispatcher: a node lost while the picture is hosted is not waited for") {
    Lab lab;
    lab.join(1, facts("a"));
    lab.join(2, facts("b"));
    const JobId id = *lab.dispatcher.submit(wish(false, true), lab.now);
    lab.step();
    lab.dispatcher.hosted(NodeId{1}, id, Epoch{1}, lab.now);
    CHECK(lab.step().orders.empty());
    lab.dispatcher.node_left(NodeId{2}, "gone", lab.now);
    CHECK(given<BeginPass>(lab.step()).size() == 1);
  }

  TEST_CASE("dispatcher: a node that joins during the picture gets workers of the same epoch") {
    RunningLab lab(wish(false, true));
    lab.join(3, facts("c"));
    const auto hosts = given<HostRun>(lab.step());
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].epoch == Epoch{1});
    REQUIRE(hosts[0].workers.size() == 1);
    CHECK(hosts[0].workers[0].first == NodeId{3});
    CHECK(lab.step().orders.empty());
    lab.dispatcher.hosted(NodeId{3}, lab.id, Epoch{1}, lab.now);
    CHECK(lab.step().orders.empty());
  }

  TEST_CASE("dispatcher: cells move onto an idle node right after a checkpoint, where that shortens the rest") {
    Lab lab;
    lab.join(1, facts("a"));
    const JobId id = *lab.dispatcher.submit(wish(), lab.now);
    lab.step();
    lab.host_all(id);
    lab.join(2, facts("b"));
    CHECK(lab.step().orders.empty());
    lab.dispatcher.checkpoint_kept(id, Epoch{1}, lab.now);
    lab.step();
    const auto hosts = given<HostRun>(lab.last);
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].epoch == Epoch{2});
    CHECK(hosts[0].from_checkpoint);
    CHECK(hosts[0].cells.size() == 2);
    // Both cells have a node of their own now: a third node is no reason to move.
    lab.host_all(id);
    lab.join(3, facts("c", 100 * megabyte, 9e6));
    lab.dispatcher.checkpoint_kept(id, Epoch{2}, lab.now);
    CHECK(lab.step().orders.empty());
  }

  TEST_CASE("dispatcher: cells leave a node that has become slow, at a checkpoint that is asked for at once") {
    DispatcherOptions options;
    options.checkpoint_every = {1'000'000'000'000};  // none is due meanwhile
    RunningLab lab(wish(), options);
    lab.join(3, facts("c"));
    const auto pace = [&](double slow) {
      lab.step(1e-9 * double(lab.now.ns) + 1);
      for (const std::uint32_t node : {2u, 3u}) lab.dispatcher.node_paced(NodeId{node}, 0.9, lab.now);
      lab.dispatcher.node_paced(NodeId{1}, slow, lab.now);
      return lab.step();
    };
    // Once is chance; everybody at once is the lab.
    CHECK(given<TakeCheckpoint>(pace(0.1)).empty());
    CHECK(given<TakeCheckpoint>(pace(0.9)).empty());
    int reports = 0;
    for (; !lab.dispatcher.nodes().at(NodeId{1}).pace.is_slow(); ++reports) {
      REQUIRE(reports < 6);
      CHECK(given<TakeCheckpoint>(lab.last).empty());
      pace(0.05);
    }
    CHECK(reports >= 3);
    CHECK(given<TakeCheckpoint>(lab.last).size() == 1);
    CHECK(lab.job(lab.id).moves == 0);
    lab.dispatcher.checkpoint_kept(lab.id, lab.epoch(), lab.now);
    auto hosts = given<HostRun>(lab.step());
    REQUIRE(hosts.size() == 1);
    CHECK(hosts[0].from_checkpoint);
    REQUIRE(hosts[0].cells.size() == 2);
    CHECK(hosts[0].cells[0].first == NodeId{2});
    CHECK(hosts[0].cells[1].first == NodeId{3});
    lab.host_all(lab.id);
    // Well again, it is trusted after its probation; nothing moves before, and not for nothing.
    while (lab.now < at(19)) {
      pace(1);
      CHECK(lab.dispatcher.nodes().at(NodeId{1}).pace.is_slow());
      CHECK(given<HostRun>(lab.last).empty());
    }
    for (int k = 0; k < 20; ++k) pace(1);
    CHECK(!lab.dispatcher.nodes().at(NodeId{1}).pace.is_slow());
    CHECK(lab.job(lab.id).moves == 1);
  }

  TEST_CASE("dispatcher: a lab that is slow as a whole moves nothing") {
    RunningLab lab;
    for (int k = 1; k < 20; ++k) {
      lab.step(k);
      for (const std::uint32_t node : {1u, 2u}) lab.dispatcher.node_paced(NodeId{node}, 0.2, lab.now);
      lab.step();
      for (const auto& [id, node] : lab.dispatcher.nodes()) CHECK(!node.pace.is_slow());
    }
  }

  TEST_CASE("dispatcher: who does not host its share in time is not suited; what goes on may last") {
    DispatcherOptions options;
    options.hosting_lease = {20'000'000'000};
    Lab lab(options);
    lab.join(1, facts("a"));
    lab.join(2, facts("b"));
    const JobId id = *lab.dispatcher.submit(wish(), lab.now);
    lab.step();
    lab.dispatcher.hosted(NodeId{1}, id, Epoch{1}, lab.now);
    lab.step(15);
    lab.dispatcher.still_hosting(NodeId{2}, id, Epoch{1}, lab.now);
    for (int second = 16; second < 35; ++second) CHECK(lab.step(second).orders.empty());
    lab.step(35);
    CHECK(lab.job(id).unsuited.at(NodeId{2}) == "did not host it within 20 s");
    const auto hosts = given<HostRun>(lab.last);
    REQUIRE(hosts.size() == 1);
    REQUIRE(hosts[0].cells.size() == 1);
    CHECK(hosts[0].cells[0].first == NodeId{1});
    // Nobody left that could: it fails by name.
    for (int second = 36; second < 130; ++second) lab.step(second);
    CHECK(lab.job(id).state == JobState::failed);
    CHECK(lab.job(id).reason.find("b: did not host it within 20 s") != std::string::npos);
  }

  TEST_CASE("dispatcher: a checkpoint that nobody answers has the job placed anew, three in a row fail it") {
    DispatcherOptions options;
    options.checkpoint_lease = {10'000'000'000};
    RunningLab lab(wish(), options);
    double second = 0;
    const auto until_asked = [&] {
      while (given<TakeCheckpoint>(lab.step(++second)).empty()) REQUIRE(second < 100);
    };
    until_asked();
    for (int k = 0; k < 5; ++k) CHECK(lab.step(++second).orders.empty());
    lab.dispatcher.still_keeping(lab.id, lab.epoch(), lab.now);
    for (int k = 0; k < 9; ++k) CHECK(lab.step(++second).orders.empty());
    lab.step(++second);
    CHECK(given<ReleaseRun>(lab.last).size() == 1);
    CHECK(given<HostRun>(lab.last).size() == 1);
    CHECK(lab.epoch() == Epoch{2});
    lab.host_all(lab.id);
    until_asked();
    lab.dispatcher.checkpoint_kept(lab.id, lab.epoch(), lab.now);
    for (int k = 0; k < 3; ++k) {
      CHECK(lab.job(lab.id).state == JobState::running);
      until_asked();
      for (int wait = 0; wait < 10; ++wait) lab.step(++second);
      if (k < 2) lab.host_all(lab.id);
    }
    CHECK(lab.job(lab.id).state == JobState::failed);
    CHECK(lab.job(lab.id).reason == "its cells answered no checkpoint within 10 s, 3 times in a row");
  }

  TEST_CASE("dispatcher: a picture begins without a node that hangs while it is hosted") {
    Lab lab;
    lab.join(1, facts("a"));
    lab.join(2, facts("b"));
    const JobId id = *lab.dispatcher.submit(wish(false, true), lab.now);
    lab.step();
    lab.dispatcher.hosted(NodeId{1}, id, Epoch{1}, lab.now);
    CHECK(given<BeginPass>(lab.step(1)).empty());
    CHECK(given<BeginPass>(lab.step(2)).size() == 1);
    lab.dispatcher.hosted(NodeId{2}, id, Epoch{1}, lab.now);
    CHECK(lab.step().orders.empty());
  }

  TEST_CASE("dispatcher: checkpoints are asked for in their turn, one at a time") {
    RunningLab lab;
    CHECK(lab.step(4.9).orders.empty());
    CHECK(given<TakeCheckpoint>(lab.step(5)).size() == 1);
    CHECK(given<TakeCheckpoint>(lab.step(11)).empty());
    lab.dispatcher.checkpoint_failed(lab.id, Epoch{1}, lab.now);
    CHECK(given<TakeCheckpoint>(lab.step(15.9)).empty());
    CHECK(given<TakeCheckpoint>(lab.step(16)).size() == 1);
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    CHECK(given<TakeCheckpoint>(lab.step(20)).empty());
    CHECK(given<TakeCheckpoint>(lab.step(21)).size() == 1);
  }

  TEST_CASE("dispatcher: a draining node gives its cells away at the next checkpoint, then says it is empty") {
    RunningLab lab;
    REQUIRE(lab.dispatcher.drain(NodeId{1}, true, lab.now));
    CHECK(lab.step().orders.empty());
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.step();
    REQUIRE(lab.last.orders.size() == 3);
    CHECK(std::get<HostRun>(lab.last.orders[1]).cells.size() == 1);
    CHECK(std::get<NodeDrained>(lab.last.orders[2]).node == NodeId{1});
    CHECK(lab.step().orders.empty());
    // No new work comes, until it is taken back.
    const JobId next = *lab.dispatcher.submit(wish(false, true), lab.now);
    lab.step();
    CHECK(!lab.job(next).run->shares.contains(NodeId{1}));
    REQUIRE(lab.dispatcher.drain(NodeId{1}, false, lab.now));
    CHECK(given<HostRun>(lab.step()).size() == 1);
    CHECK(lab.job(next).run->shares.contains(NodeId{1}));
    CHECK(!lab.dispatcher.drain(NodeId{9}, true, lab.now));
  }

  TEST_CASE("dispatcher: ray workers leave a draining node alone, once others are at work") {
    RunningLab lab(wish(false, true));
    REQUIRE(lab.dispatcher.drain(NodeId{1}, true, lab.now));
    lab.step();
    REQUIRE(lab.last.orders.size() == 2);
    CHECK(std::get<ReleaseRun>(lab.last.orders[0]).node == NodeId{1});
    CHECK(std::get<NodeDrained>(lab.last.orders[1]).node == NodeId{1});
    REQUIRE(lab.dispatcher.drain(NodeId{2}, true, lab.now));
    CHECK(lab.step().orders.empty());  // the last one stays
    // Taken back it stays out of this epoch: its `hosted` may be an old one.
    REQUIRE(lab.dispatcher.drain(NodeId{1}, false, lab.now));
    CHECK(lab.step().orders.empty());
    lab.join(1, facts("a"));
    CHECK(given<HostRun>(lab.step()).size() == 1);
  }

  TEST_CASE("dispatcher: a picture that awaited nobody but a draining node begins when that is sent away") {
    Lab lab;
    lab.join(1, facts("a"));
    lab.join(2, facts("b"));
    const JobId id = *lab.dispatcher.submit(wish(false, true), lab.now);
    lab.step();
    REQUIRE(lab.dispatcher.drain(NodeId{1}, true, lab.now));
    lab.dispatcher.hosted(NodeId{2}, id, Epoch{1}, lab.now);
    lab.step();
    CHECK(given<ReleaseRun>(lab.last).size() == 1);
    CHECK(given<BeginPass>(lab.last).size() == 1);
  }

  TEST_CASE("dispatcher: a job that loses three nodes fails and names them; kicked ones do not count") {
    RunningLab lab;
    REQUIRE(lab.dispatcher.kick(NodeId{2}, lab.now));
    lab.step();
    REQUIRE(given<DropNode>(lab.last).size() == 1);
    lab.dispatcher.node_left(NodeId{1}, "gone", lab.now);
    lab.join(2, facts("b"));
    lab.step(5);
    lab.join(2, facts("b"));  // its link broke unnoticed
    lab.step(10);
    CHECK(lab.job(lab.id).state == JobState::running);
    lab.join(3, facts("c"));
    lab.dispatcher.node_left(NodeId{3}, "gone", lab.now);  // hosted nothing
    lab.dispatcher.node_left(NodeId{2}, "gone", lab.now);
    lab.step();
    REQUIRE(given<JobEnded>(lab.last).size() == 1);
    CHECK(lab.job(lab.id).reason == "lost 3 nodes while running: a b b");
    REQUIRE(lab.dispatcher.retry(lab.id, lab.now));
    lab.join(4, facts("d"));
    lab.step();
    CHECK(lab.job(lab.id).state == JobState::running);
    CHECK(lab.epoch() == Epoch{5});
  }

  TEST_CASE("dispatcher: nodes that are lost together count once: a controller that is cut off ends no job") {
    Lab lab;
    for (std::uint32_t node = 1; node <= 6; ++node) lab.join(node, facts("a" + std::to_string(node)));
    const JobId id = *lab.dispatcher.submit(wish(), lab.now);
    lab.step();
    lab.host_all(id);
    for (std::uint32_t node = 1; node <= 6; ++node) {
      lab.dispatcher.node_left(NodeId{node}, "silent", lab.now);
      lab.step(0.2 * node);
    }
    CHECK(lab.job(id).state == JobState::queued);
    CHECK(lab.job(id).lost_nodes.size() == 1);
    lab.join(7, facts("b"));
    CHECK(given<HostRun>(lab.step()).size() == 1);
  }

  TEST_CASE("dispatcher: a node that could not host its share is not asked again, and all is placed anew") {
    RunningLab lab;
    lab.dispatcher.host_failed(NodeId{1}, lab.id, Epoch{1}, "out of memory", lab.now);
    auto hosts = given<HostRun>(lab.step());
    REQUIRE(hosts.size() == 1);
    REQUIRE(hosts[0].cells.size() == 1);
    CHECK(hosts[0].cells[0].first == NodeId{2});
    lab.dispatcher.host_failed(NodeId{2}, lab.id, Epoch{2}, "disk full", lab.now);
    CHECK(given<HostRun>(lab.step()).empty());
    CHECK(lab.job(lab.id).reason.ends_with("a: out of memory; b: disk full"));
    lab.join(1, facts("a"));
    CHECK(given<HostRun>(lab.step()).size() == 1);
  }

  TEST_CASE("dispatcher: every checkpoint is written down, since what it replaces is thrown away") {
    RunningLab lab;
    for (int k = 0; k < 3; ++k) {
      lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
      const Dispatched& dispatched = lab.step();
      REQUIRE(dispatched.records.size() == 1);
      CHECK(std::holds_alternative<journal::CheckpointKept>(dispatched.records[0]));
    }
  }

  TEST_CASE("dispatcher: cancelled it is released everywhere; what has ended is not cancelled, nor retried when done") {
    RunningLab lab;
    REQUIRE(lab.dispatcher.cancel(lab.id, lab.now));
    lab.step();
    REQUIRE(lab.last.orders.size() == 2);
    CHECK(!std::get<ReleaseRun>(lab.last.orders[0]).node);
    CHECK(std::get<JobEnded>(lab.last.orders[1]).state == JobState::cancelled);
    CHECK(!lab.dispatcher.cancel(lab.id, lab.now));
    REQUIRE(lab.dispatcher.retry(lab.id, lab.now));
    CHECK(!lab.dispatcher.retry(lab.id, lab.now));
    lab.step();
    lab.host_all(lab.id);
    lab.dispatcher.pass_finished(lab.id, Epoch{2}, lab.now);
    lab.step();
    CHECK(!lab.dispatcher.retry(lab.id, lab.now));
    CHECK(!lab.dispatcher.cancel(JobId{77}, lab.now));
  }

  TEST_CASE("dispatcher: a failed pass fails its job with the reason") {
    RunningLab lab;
    lab.dispatcher.pass_failed(lab.id, Epoch{1}, "scene file has gone", lab.now);
    const auto ended = given<JobEnded>(lab.step());
    REQUIRE(ended.size() == 1);
    CHECK(ended[0].state == JobState::failed);
    CHECK(ended[0].reason == "scene file has gone");
  }

  TEST_CASE("dispatcher: wishes that can not be are refused") {
    Lab lab;
    JobWish nothing = wish(false, false), flat = wish(), odd = wish(), huge = wish();
    flat.grid = {2, 0, 1};
    flat.patches = {};
    odd.patches = {1};
    huge.bytes_per_patch = ~std::uint64_t{0};
    for (const JobWish& bad : {nothing, flat, odd, huge}) {
      const auto id = lab.dispatcher.submit(bad, lab.now);
      REQUIRE(!id);
      CHECK(id.error().code == ErrorCode::bad_input);
    }
    CHECK(lab.dispatcher.jobs().empty());
  }

  TEST_CASE(
      "dispatcher: after a restart jobs go on from their checkpoints, epochs go on growing, what ended stays so") {
    RunningLab lab;
    const JobId cancelled = *lab.dispatcher.submit(wish(), lab.now);
    const JobId waiting = *lab.dispatcher.submit(wish(false, true), lab.now);
    REQUIRE(lab.dispatcher.cancel(cancelled, lab.now));
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.step();
    lab.restart();
    CHECK(lab.dispatcher.nodes().empty());
    CHECK(lab.job(lab.id).state == JobState::queued);
    CHECK(lab.job(cancelled).state == JobState::cancelled);
    lab.join(5, facts("e"));
    lab.step();
    const auto hosts = given<HostRun>(lab.last);
    REQUIRE(hosts.size() == 2);
    CHECK(hosts[0].epoch == Epoch{2});
    CHECK(hosts[0].from_checkpoint);
    CHECK(hosts[1].job == waiting);
    CHECK(lab.dispatcher.submit(wish(), lab.now)->value == waiting.value + 1);
  }

  TEST_CASE("dispatcher: the summary of a journal restores the same jobs") {
    RunningLab lab(wish(true, true));
    lab.dispatcher.checkpoint_kept(lab.id, Epoch{1}, lab.now);
    lab.dispatcher.node_left(NodeId{2}, "gone", lab.now);
    lab.step();
    lab.host_all(lab.id);
    lab.dispatcher.pass_finished(lab.id, Epoch{2}, lab.now);
    const JobId failed = *lab.dispatcher.submit(wish(), lab.now);
    lab.step();
    lab.dispatcher.pass_failed(failed, Epoch{1}, "no", lab.now);
    lab.step();
    const auto whole = Dispatcher::restored({}, lab.journal);
    const auto brief = Dispatcher::restored({}, lab.dispatcher.summary());
    REQUIRE(whole);
    REQUIRE(brief);
    REQUIRE(whole->jobs().size() == 2);
    for (const auto& [id, job] : whole->jobs()) {
      const LabJob& other = brief->jobs().at(id);
      CHECK(job.wish == other.wish);
      CHECK(job.state == other.state);
      CHECK(job.pass == other.pass);
      CHECK(job.epoch == other.epoch);
      CHECK(job.has_checkpoint == other.has_checkpoint);
      CHECK(job.lost_nodes == other.lost_nodes);
      CHECK(job.reason == other.reason);
    }
  }

  TEST_CASE("dispatcher: draining holds for a node's name, through a rejoin and a restart") {
    RunningLab lab;
    REQUIRE(lab.dispatcher.drain(NodeId{1}, true, lab.now));
    lab.step();
    lab.dispatcher.node_left(NodeId{1}, "rebooted", lab.now);
    lab.join(3, facts("a"));
    CHECK(lab.dispatcher.nodes().at(NodeId{3}).draining);
    lab.step();
    for (const std::vector<JournalEntry>& journal : {lab.journal, lab.dispatcher.summary()}) {
      auto restored = Dispatcher::restored({}, journal);
      REQUIRE(restored);
      restored->node_joined(NodeId{7}, facts("a"), lab.now);
      restored->node_joined(NodeId{8}, facts("b"), lab.now);
      CHECK(restored->nodes().at(NodeId{7}).draining);
      CHECK(!restored->nodes().at(NodeId{8}).draining);
    }
    // While it is away it can be taken back, but nobody can be drained who is not there.
    lab.dispatcher.node_left(NodeId{3}, "rebooted", lab.now);
    CHECK(lab.dispatcher.drain("a", false));
    CHECK(!lab.dispatcher.drain("a", false));
    CHECK(!lab.dispatcher.drain("a", true));
    lab.join(4, facts("a"));
    CHECK(!lab.dispatcher.nodes().at(NodeId{4}).draining);
    lab.step();
    lab.restart();
    CHECK(lab.dispatcher.draining().empty());
  }

  TEST_CASE("dispatcher: a forgotten job is gone, and its number is not given again") {
    RunningLab lab;
    CHECK(!lab.dispatcher.forget(lab.id));
    CHECK(!lab.dispatcher.forget(JobId{9}));
    const JobId second = *lab.dispatcher.submit(wish(), lab.now);
    REQUIRE(lab.dispatcher.cancel(second, lab.now));
    REQUIRE(lab.dispatcher.forget(second));
    lab.step();
    CHECK(lab.dispatcher.jobs().size() == 1);
    for (const std::vector<JournalEntry>& journal : {lab.journal, lab.dispatcher.summary()}) {
      auto restored = Dispatcher::restored({}, journal);
      REQUIRE(restored);
      CHECK(restored->jobs().size() == 1);
      CHECK(*restored->submit(wish(), lab.now) == JobId{3});
    }
    REQUIRE(lab.dispatcher.cancel(lab.id, lab.now));
    REQUIRE(lab.dispatcher.forget(lab.id));
    lab.step();
    lab.restart();
    CHECK(*lab.dispatcher.submit(wish(), lab.now) == JobId{3});
  }

  TEST_CASE("dispatcher: a full queue takes no more, and says what to do") {
    DispatcherOptions options;
    options.most_waiting_jobs = 3;
    Lab lab(options);
    for (int i = 0; i < 3; ++i) REQUIRE(lab.dispatcher.submit(wish(), lab.now));
    const auto refused = lab.dispatcher.submit(wish(), lab.now);
    REQUIRE(!refused);
    CHECK(refused.error().code == ErrorCode::failed);
    CHECK(refused.error().text().find("3 jobs wait") != std::string::npos);
    REQUIRE(lab.dispatcher.cancel(JobId{2}, lab.now));
    CHECK(lab.dispatcher.submit(wish(), lab.now));
  }

  TEST_CASE("dispatcher: a journal that no dispatcher wrote is refused, with the entry") {
    const std::vector<std::vector<JournalEntry>> journals = {
        {journal::EpochBegun{JobId{1}, Epoch{1}}},
        {journal::Submitted{JobId{1}, wish()}, journal::Submitted{JobId{1}, wish()}},
        {journal::Submitted{JobId{1}, wish()}, journal::EpochBegun{JobId{1}, Epoch{0}}},
        {journal::Submitted{JobId{1}, wish()}, journal::Retried{JobId{1}}},
        {journal::Submitted{JobId{1}, wish()}, journal::Ended{JobId{1}, JobState::running, {}}},
        {journal::Submitted{JobId{1}, wish(false, false)}},
    };
    for (const auto& entries : journals) {
      const auto restored = Dispatcher::restored({}, entries);
      REQUIRE(!restored);
      CHECK(restored.error().where == "journal entry " + std::to_string(entries.size()));
    }
  }
}
