#include "actors/cluster/lead.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <future>
#include <set>

#include "actors/cluster/lead_file.hpp"
#include "actors/cluster/run_lead.hpp"
#include "actors/codec.hpp"
#include "actors/drive.hpp"
#include "actors/system_config.hpp"
#include "core/light/escape.hpp"

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;

using tick_atom = caf::atom_constant<caf::atom("tick")>;

constexpr auto tick = 100ms;
constexpr auto complaint_waits = Duration{12'000'000'000};  // longer than a lease: who is silent is lost by then
constexpr auto refresh_every = Duration{1'000'000'000};

/// A solution that a thread of its own has written.
struct Written {
  JobId job;
  Epoch epoch;
  bool is_end = false;
  std::uint64_t sequence = 0;  ///< of the writings of this lead: an older one never replaces a newer
  std::string hash;            ///< empty: see reason
  std::string reason;
  EnergyLedger energy;
  SolveCounters counters;
};

}  // namespace

/// The lead's actor: all of it on one thread.
class LeadState {
 public:
  static constexpr const char* name = "lead";

  void begin(caf::event_based_actor* self, LeadOptions options, std::shared_ptr<BlobCache> blobs, Dispatcher dispatcher,
             std::map<JobId, KeptJob> kept) {
    self_ = self;
    options_ = std::move(options);
    blobs_ = std::move(blobs);
    dispatcher_ = std::move(dispatcher);
    for (auto& [id, job] : kept) {
      jobs_[id].kept = std::move(job);
      jobs_[id].submitted = clock_.now();
    }
  }
  void use(const Link& link) {
    link_ = link;
    self_->delayed_send(self_, tick, tick_atom{});
  }
  void end() {
    for (const auto& [node, known] : nodes_) to_node(node, Dismissed{"the controller is stopping"});
    if (link_) link_->stop();
  }

  // ---- The link ----

  void on(const LinkUp& up) {
    if (up.who.role != Role::node) return link_->close(up.peer, "only nodes may talk to this port");
    strangers_[up.peer] = up;
  }
  void on(const LinkDown& down) {
    strangers_.erase(down.peer);
    const auto found = node_of_.find(down.peer);
    if (found == node_of_.end()) return;
    const NodeId node = found->second;
    spdlog::warn("node {} ({}) is gone: {}", node.value, nodes_[node].name, down.reason);
    forget(node);
    dispatcher_.node_left(node, down.reason, clock_.now());
    step();
  }
  void on(const FrameArrived& frame) {
    Expected<ClusterMessage> message = decode_cluster(*frame.bytes);
    if (frame.bulk) link_->consumed(frame);
    if (!message) return link_->close(frame.peer, "a frame " + message.error().message);
    if (const auto* registration = std::get_if<Registration>(&*message)) return admit(frame.peer, *registration);
    const auto found = node_of_.find(frame.peer);
    if (found == node_of_.end()) return link_->close(frame.peer, "it did not register");
    std::visit([&, node = found->second](auto& one) { on(node, one); }, *message);
    step();
  }

  // ---- What nodes say ----

  void admit(PeerId peer, const Registration& facts) {
    const auto stranger = strangers_.find(peer);
    if (stranger == strangers_.end()) return;
    if (facts.cores < 1 || facts.cores > 4096 || !(facts.rays_per_s >= 0 && facts.rays_per_s < 1e15) ||
        facts.memory_bytes > 1ull << 50)
      return link_->close(peer, "what it says of itself can not be");
    const NodeId node{++last_node_};
    node_of_[peer] = node;
    KnownNode& known = nodes_[node];
    known = {stranger->second.who.name,
             stranger->second.version,
             peer,
             {node, stranger->second.host, stranger->second.port, stranger->second.boot_id},
             {}};
    strangers_.erase(stranger);
    spdlog::info("node {} ({}) joined: {} cores, {:.1f} Mray/s each, {:.1f} GiB", node.value, known.name, facts.cores,
                 facts.rays_per_s / 1e6, static_cast<double>(facts.memory_bytes) / (1u << 30));
    dispatcher_.node_joined(node, {known.name, facts.cores, facts.memory_bytes, facts.rays_per_s}, clock_.now());
    to_node(node, Welcome{node});
    step();
  }
  template <class Other>
  void on(NodeId, Other&) {}  // of the other direction
  void on(NodeId node, NodeReport& report) {
    dispatcher_.node_reported(node, report.free_memory_bytes, clock_.now());
    if (!std::isfinite(report.busy_share)) report.busy_share = 0;
    nodes_[node].report = std::move(report);
  }
  void on(NodeId node, Leaving& leaving) {
    spdlog::info("node {} ({}) leaves: {}", node.value, nodes_[node].name, leaving.reason);
    forget(node);
    dispatcher_.node_parted(node, leaving.reason.substr(0, 200), clock_.now());
  }
  void on(NodeId node, Hosted& hosted) { dispatcher_.hosted(node, hosted.job, hosted.epoch, clock_.now()); }
  void on(NodeId node, HostFailed& failed) {
    if (!run_at(failed.job, failed.epoch)) return;
    say(failed.job, "node " + nodes_[node].name + " can not host it: " + failed.reason);
    // The node that can't be reached is usually gone, and the lead about to notice: then the job is hosted anew anyway.
    if (failed.is_unreachable) return complaints_.push_back({node, failed, clock_.now() + complaint_waits});
    dispatcher_.host_failed(node, failed.job, failed.epoch, failed.reason, clock_.now());
  }
  void on(NodeId node, WantBlob& want) {
    std::uint64_t total = 0;
    Expected<Bytes> bytes = blobs_->part(want.hash, want.offset, blob_part_bytes, total);
    if (!bytes) return spdlog::warn("node {} wants a blob: {}", node.value, bytes.error().text());
    to_node(node, BlobPart{want.hash, want.offset, total, std::move(*bytes)}, true);
  }
  void on(NodeId node, RunMessage& message) {
    RunLead* const run = run_at(message.job, message.epoch);
    if (!run) return;
    Expected<Message> content = decode(message.message);
    if (!content) return spdlog::warn("a message of job {} is refused: {}", message.job.value, content.error().text());
    run->accept(node, message, std::move(*content), clock_.now());
    look_at(*run);
  }
  void on(NodeId node, CellImage& image) {
    RunLead* const run = run_at(image.job, image.epoch);
    if (!run) return;
    run->accept(node, std::move(image), clock_.now());
    look_at(*run);
  }

  // ---- Jobs ----

  Expected<JobId> submit(const JobOrder& order) {
    if (!blobs_->find(order.solution)) return Error{ErrorCode::bad_input, "scene", "has not been handed in"};
    Expected<JobId> id = dispatcher_.submit(order.wish, clock_.now());
    if (!id) return id.error();
    Job& job = jobs_[*id];
    job.kept = {order, order.solution};
    job.submitted = clock_.now();
    say(*id, "submitted by " + order.owner);
    if (Status kept = decide(); !kept) return kept.error();
    return id;
  }
  Status cancel(JobId job) { return decided(dispatcher_.cancel(job, clock_.now())); }
  Status retry(JobId job) {
    jobs_[job].ended.reset();
    return decided(dispatcher_.retry(job, clock_.now()));
  }
  Status drain(const std::string& node_name, bool is_draining) {
    return for_named(node_name, [&](NodeId node) { return dispatcher_.drain(node, is_draining, clock_.now()); });
  }
  Status kick(const std::string& node_name) {
    return for_named(node_name, [&](NodeId node) { return dispatcher_.kick(node, clock_.now()); });
  }

  LabView view() {
    LabView view;
    const Instant now = clock_.now();
    for (const auto& [id, node] : dispatcher_.nodes()) {
      NodeView& seen = view.nodes.emplace_back();
      const KnownNode& known = nodes_[id];
      seen.id = id, seen.node = node, seen.host = known.peer.host, seen.version = known.version;
      seen.report = known.report;
      seen.seen_s = 1e-9 * static_cast<double>((now - node.heard).ns);
      for (const auto& counters : link_->monitor().peers())
        if (counters->peer == known.link) seen.bytes_in = counters->bytes_in, seen.bytes_out = counters->bytes_out;
      for (const auto& [job, lab_job] : dispatcher_.jobs())
        if (lab_job.run && lab_job.run->shares.count(id)) seen.jobs.push_back(job);
    }
    for (const auto& [id, lab_job] : dispatcher_.jobs()) {
      JobView& seen = view.jobs.emplace_back();
      Job& job = jobs_[id];
      seen.id = id, seen.job = lab_job, seen.order = job.kept.order, seen.solution = job.kept.solution;
      seen.energy = job.energy, seen.counters = job.counters;
      seen.columns = lab_job.wish.picture ? job.kept.order.picture.width : 0;
      seen.columns_done = lab_job.state == JobState::done ? seen.columns : 0;
      if (job.run) {
        seen.radiosity = job.run->radiosity(), seen.cells = job.run->cells();
        if (const Balancer* balancer = job.run->balancer())
          seen.columns_done = balancer->finished_columns(), seen.rays = balancer->rays();
      }
      seen.seconds = 1e-9 * static_cast<double>((job.ended.value_or(now) - job.submitted).ns);
    }
    return view;
  }
  Expected<Image> picture(JobId id) {
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return Error{ErrorCode::bad_input, "job " + std::to_string(id.value), "there is none"};
    if (found->second.run && found->second.run->balancer()) return found->second.run->balancer()->image();
    return Error{ErrorCode::failed, "job " + std::to_string(id.value), "has no picture yet"};
  }

  // ---- Time ----

  void on_tick() {
    const Instant now = clock_.now();
    for (; !complaints_.empty() && complaints_.front().due <= now; complaints_.pop_front()) {
      const Complaint& complaint = complaints_.front();
      const HostFailed& failed = complaint.failed;
      if (run_at(failed.job, failed.epoch))
        dispatcher_.host_failed(complaint.node, failed.job, failed.epoch, failed.reason, now);
    }
    if ((now - refreshed_).ns >= refresh_every.ns) {
      refreshed_ = now;
      for (auto& [id, job] : jobs_)
        if (job.run) job.run->refresh(now);
    }
    step();
  }

  void on(Written& written) {
    const auto found = jobs_.find(written.job);
    RunLead* const run = run_at(written.job, written.epoch);
    if (found == jobs_.end() || !run) return;
    Job& job = found->second;
    if (written.sequence < job.written) return;
    job.written = written.sequence;
    if (written.hash.empty()) {
      say(written.job, "the light can not be kept: " + written.reason);
      if (written.is_end)
        dispatcher_.pass_failed(written.job, written.epoch, written.reason, clock_.now());
      else
        dispatcher_.checkpoint_failed(written.job, written.epoch, clock_.now());
    } else {
      const std::string before = std::exchange(job.kept.solution, written.hash);
      if (before != job.begun_with) stale_.insert(before);
      job.energy = written.energy, job.counters = written.counters;
      if (written.is_end)
        dispatcher_.pass_finished(written.job, written.epoch, clock_.now());
      else
        dispatcher_.checkpoint_kept(written.job, written.epoch, clock_.now());
    }
    step();
    drop_stale();
  }

 private:
  /// Checkpoints that newer ones have replaced. What a job began with stays: another job may begin with the same.
  void drop_stale() {
    for (const auto& [id, job] : jobs_)
      for (const std::string& used : {job.kept.solution, job.kept.order.solution, job.begun_with}) stale_.erase(used);
    for (const std::string& hash : stale_) blobs_->remove(hash);
    stale_.clear();
  }

  struct KnownNode {
    std::string name, version;
    PeerId link;
    Peer peer;
    NodeReport report;
  };
  struct Job {
    KeptJob kept;
    std::unique_ptr<RunLead> run;
    std::uint64_t written = 0;  ///< sequence of the light kept last
    std::string begun_with;     ///< blob that the epoch under way began with
    Instant submitted;
    std::optional<Instant> ended;
    EnergyLedger energy;
    SolveCounters counters;
  };

  RunLead* run_at(JobId id, Epoch epoch) {
    const auto found = jobs_.find(id);
    if (found == jobs_.end() || !found->second.run || found->second.run->epoch() != epoch) return nullptr;
    return found->second.run.get();
  }

  Status decided(Status status) {
    if (!status) return status;
    return decide();
  }
  Status for_named(const std::string& wanted, const std::function<Status(NodeId)>& act) {
    for (const auto& [id, known] : nodes_)
      if (known.name == wanted || std::to_string(id.value) == wanted) return decided(act(id));
    return Error{ErrorCode::bad_input, "node " + wanted, "there is none"};
  }

  void step() { (void)decide(); }
  /// The dispatcher decides; what it decided is written down, then carried out. @error io: nothing was carried out
  Status decide() {
    const Instant now = clock_.now();
    while (dispatcher_.has_work(now)) {
      Dispatched due = dispatcher_.step(now);
      if (!due.records.empty())
        if (Status kept = keep(); !kept) {
          spdlog::error("{}", kept.error().text());
          return kept;
        }
      for (const Order& order : due.orders) std::visit([this](const auto& one) { carry_out(one); }, order);
      if (due.orders.empty() && due.records.empty()) break;
    }
    return Done{};
  }
  Status keep() {
    LeadFile file;
    file.journal = dispatcher_.summary();
    for (const auto& [id, job] : jobs_) file.jobs[id] = job.kept;
    return write_lead_file(options_.folder + "/jobs", file);
  }

  // ---- Orders ----

  void carry_out(const HostRun& order) {
    Job& job = jobs_[order.job];
    const bool is_new = !job.run || job.run->epoch() != order.epoch;
    if (is_new) {
      job.run =
          std::make_unique<RunLead>(order, job.kept.order.picture, job.kept.order.eps,
                                    [this](NodeId node, const ClusterMessage& message) { to_node(node, message); });
      const bool is_first = order.pass == Pass::radiosity && !order.from_checkpoint;
      job.begun_with = is_first ? job.kept.order.solution : job.kept.solution;
    }
    HostShare share{order.job, order.epoch, order.pass, job.begun_with, {}, {}, job.kept.order.picture, 0, 0};
    if (order.pass == Pass::radiosity) {
      std::size_t count = 0;
      for (const auto& [node, cells] : order.cells) count += cells.size();
      share.cells.resize(count);
      for (const auto& [node, cells] : order.cells) {
        share.peers.push_back(nodes_[node].peer);
        for (const CellId cell : cells) share.cells.at(cell.value) = node;
      }
      for (const auto& [node, cells] : order.cells) to_node(node, share);
      say(order.job, "epoch " + std::to_string(order.epoch.value) + ": cells go to " + names(order.cells));
      return;
    }
    for (const auto& [node, range] : job.run->add_workers(order)) {
      share.first_worker = range.first, share.workers = range.second;
      to_node(node, share);
    }
    say(order.job, "epoch " + std::to_string(order.epoch.value) + ": the picture is traced by " + names(order.workers));
  }
  void carry_out(const BeginPass& order) {
    if (RunLead* const run = run_at(order.job, order.epoch)) {
      run->begin(clock_.now());
      look_at(*run);
    }
  }
  void carry_out(const ReleaseRun& order) {
    Job& job = jobs_[order.job];
    for (const auto& [node, known] : nodes_)
      if (!order.node || *order.node == node) to_node(node, ReleaseShare{order.job, order.epoch});
    if (!job.run || job.run->epoch() != order.epoch) return;
    if (order.node)
      job.run->lose_workers(*order.node, clock_.now());
    else
      job.run.reset();
  }
  void carry_out(const TakeCheckpoint& order) {
    if (RunLead* const run = run_at(order.job, order.epoch)) {
      run->take_checkpoint(clock_.now());
      look_at(*run);
    }
  }
  void carry_out(const JobEnded& order) {
    jobs_[order.job].ended = clock_.now();
    say(order.job, std::string(name_of(order.state)) + (order.reason.empty() ? "" : ": " + order.reason));
  }
  void carry_out(const DropNode& order) {
    const auto found = nodes_.find(order.node);
    if (found == nodes_.end()) return;
    to_node(order.node, Dismissed{order.reason});
    link_->close(found->second.link, order.reason);
    forget(order.node);
  }
  void carry_out(const NodeDrained& order) { spdlog::info("node {} is drained", nodes_[order.node].name); }

  // ---- Passes ----

  void look_at(RunLead& run) {
    const RunLead::Wants wants = run.due();
    if (wants == RunLead::Wants::nothing) return;
    Job& job = jobs_[run.job()];
    if (run.pass() == Pass::picture) {
      const std::string path = options_.folder + "/results/" + std::to_string(run.job().value) + ".exr";
      const Status written = options_.write_picture(path, run.balancer()->image());
      if (written)
        dispatcher_.pass_finished(run.job(), run.epoch(), clock_.now());
      else
        dispatcher_.pass_failed(run.job(), run.epoch(), written.error().text(), clock_.now());
      return;
    }
    // On a thread of its own: reading and writing take seconds.
    const caf::actor lead = caf::actor_cast<caf::actor>(self_);
    self_->system().spawn<caf::detached>(
        [lead, sequence = ++last_writing_, id = run.job(), epoch = run.epoch(), is_end = wants == RunLead::Wants::end,
         base = blobs_->find(job.begun_with),
         images = std::make_shared<std::map<CellId, CellImage>>(run.take_images(clock_.now())), options = options_,
         blobs = blobs_](caf::event_based_actor* writer) {
          Written written{id, epoch, is_end, sequence, "", "", {}, {}};
          try {
            written.reason = keep_light(written, base, *images, options, *blobs);
          } catch (const std::exception& error) {
            written.reason = error.what();
          }
          writer->send(lead, std::move(written));
        });
  }

  /// @returns why it failed
  static std::string keep_light(Written& written, const std::optional<std::string>& base,
                                const std::map<CellId, CellImage>& images, const LeadOptions& options,
                                BlobCache& blobs) {
    if (!base) return "what the pass began with is gone";
    Expected<Solution> solution = options.read_solution(*base);
    if (!solution) return solution.error().text();
    if (Status put = put_images(*solution, images); !put) return put.error().text();
    solution->converged = written.is_end;
    if (written.is_end) solution->energy.escaped = escaped_power(*solution, Parallel(options.threads));
    const std::string path =
        options.folder + "/light." + std::to_string(written.job.value) + "." + std::to_string(written.sequence);
    if (Status kept = options.write_solution(path, *solution); !kept) return kept.error().text();
    Expected<std::string> hash = blobs.adopt(path);
    if (!hash) return hash.error().text();
    written.hash = *hash, written.energy = solution->energy, written.counters = solution->counters;
    return "";
  }

  void forget(NodeId node) {
    const auto found = nodes_.find(node);
    if (found == nodes_.end()) return;
    node_of_.erase(found->second.link);
    nodes_.erase(found);
    for (auto& [id, job] : jobs_)
      if (job.run && job.run->pass() == Pass::picture && job.run->hosts(node)) {
        job.run->lose_workers(node, clock_.now());
        look_at(*job.run);
      }
  }

  void to_node(NodeId node, const ClusterMessage& message, bool is_bulk = false) {
    const auto found = nodes_.find(node);
    if (found == nodes_.end()) return;
    auto bytes = std::make_shared<const Bytes>(encode(message));
    if (is_bulk)
      link_->send_bulk(found->second.link, std::move(bytes));
    else
      link_->send_control(found->second.link, std::move(bytes));
  }
  template <class Pairs>
  std::string names(const Pairs& pairs) {
    std::string text;
    for (const auto& [node, what] : pairs) text += (text.empty() ? "" : ", ") + nodes_[node].name;
    return text;
  }
  void say(JobId job, const std::string& line) {
    spdlog::info("job {}: {}", job.value, line);
    if (options_.log) options_.log(job, line);
  }

  caf::event_based_actor* self_ = nullptr;
  LeadOptions options_;
  std::shared_ptr<BlobCache> blobs_;
  std::optional<Link> link_;
  Clock clock_;
  Instant refreshed_;
  Dispatcher dispatcher_;
  std::uint32_t last_node_ = 0;
  std::uint64_t last_writing_ = 0;
  std::set<std::string> stale_;
  struct Complaint {
    NodeId node;
    HostFailed failed;
    Instant due;
  };
  std::deque<Complaint> complaints_;  ///< of nodes about others
  std::map<PeerId, LinkUp> strangers_;
  std::map<PeerId, NodeId> node_of_;
  std::map<NodeId, KnownNode> nodes_;
  std::map<JobId, Job> jobs_;
};

namespace {

/// Something to be done on the lead's thread.
struct Errand {
  std::function<void(LeadState&)> run;
};
struct UseLink {
  Link link;
};

struct Beginning {
  LeadOptions options;
  std::shared_ptr<BlobCache> blobs;
  Dispatcher dispatcher;
  std::map<JobId, KeptJob> kept;
};

using LeadSelf = caf::stateful_actor<LeadState>;

caf::behavior lead_actor(LeadSelf* self, const std::shared_ptr<Beginning>& with) {
  report_failures(self, "lead");
  self->state.begin(self, with->options, with->blobs, std::move(with->dispatcher), std::move(with->kept));
  self->set_exit_handler([self](caf::exit_msg& exit) {
    self->state.end();
    self->quit(exit.reason);
  });
  return {
      [self](const UseLink& use) { self->state.use(use.link); },
      [self](const Errand& errand) { errand.run(self->state); },
      [self](const LinkUp& up) { self->state.on(up); },
      [self](const LinkDown& down) { self->state.on(down); },
      [](const DialFailed&) {},
      [self](const FrameArrived& frame) { self->state.on(frame); },
      [](const LinkBlocked&) {},
      [](const LinkReady&) {},
      [self](Written& written) { self->state.on(written); },
      [self](tick_atom) {
        self->state.on_tick();
        self->delayed_send(self, tick, tick_atom{});
      },
  };
}

}  // namespace

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Written)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Errand)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::UseLink)

namespace lichthof::actors {

Expected<std::unique_ptr<Lead>> Lead::start(LeadOptions options) {
  std::unique_ptr<Lead> lead(new Lead);
  std::error_code error;
  std::filesystem::create_directories(options.folder + "/results", error);
  // What an earlier process was writing.
  for (const auto& entry : std::filesystem::directory_iterator(options.folder, error))
    for (const char* begin : {"light.", "begin.", "shown."})
      if (entry.path().filename().string().starts_with(begin)) std::filesystem::remove(entry.path(), error);
  lead->blobs_ = std::make_shared<BlobCache>(options.folder + "/blobs", 64ull << 30);
  if (Status opened = lead->blobs_->open(); !opened) return opened.error();
  Expected<LeadFile> file = read_lead_file(options.folder + "/jobs");
  if (!file) return file.error();
  Expected<Dispatcher> dispatcher = Dispatcher::restored(options.dispatcher, file->journal);
  if (!dispatcher) return dispatcher.error();

  SystemOptions system_options;
  system_options.network = true;
  lead->config_ = std::make_unique<SystemConfig>(system_options);
  lead->system_ = std::make_unique<caf::actor_system>(*lead->config_);
  const auto with =
      std::make_shared<Beginning>(Beginning{options, lead->blobs_, std::move(*dispatcher), std::move(file->jobs)});
  lead->actor_ = lead->system_->spawn<caf::detached>(lead_actor, with);
  Expected<Link> link = Link::start(*lead->system_, lead->actor_, options.link);
  if (!link) return link.error();
  lead->link_ = *link;
  Expected<std::uint16_t> port = link->listen(options.host, options.port);
  if (!port) return port.error();
  lead->port_ = *port;
  caf::anon_send(lead->actor_, UseLink{*link});
  return lead;
}

Lead::~Lead() {
  if (!actor_) return;
  caf::anon_send_exit(actor_, caf::exit_reason::user_shutdown);
  caf::scoped_actor waiting{*system_};
  waiting->wait_for(actor_);
  actor_ = nullptr;
}

template <class Result>
Result Lead::ask(std::function<Result(LeadState&)> question) {
  const auto answer = std::make_shared<std::promise<Result>>();
  std::future<Result> result = answer->get_future();
  caf::anon_send(actor_, Errand{[answer, question = std::move(question)](LeadState& state) {
                   answer->set_value(question(state));
                 }});
  return result.get();
}

Expected<JobId> Lead::submit(const JobOrder& order) {
  return ask<Expected<JobId>>([&](LeadState& state) { return state.submit(order); });
}
Status Lead::cancel(JobId job) {
  return ask<Status>([&](LeadState& state) { return state.cancel(job); });
}
Status Lead::retry(JobId job) {
  return ask<Status>([&](LeadState& state) { return state.retry(job); });
}
Status Lead::drain(const std::string& node, bool is_draining) {
  return ask<Status>([&](LeadState& state) { return state.drain(node, is_draining); });
}
Status Lead::kick(const std::string& node) {
  return ask<Status>([&](LeadState& state) { return state.kick(node); });
}
LabView Lead::view() {
  return ask<LabView>([](LeadState& state) { return state.view(); });
}
Expected<Image> Lead::picture(JobId job) {
  return ask<Expected<Image>>([&](LeadState& state) { return state.picture(job); });
}

}  // namespace lichthof::actors
