#include "actors/cluster/lead.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <future>

#include "actors/cluster/lead_state.hpp"
#include "actors/system_config.hpp"

namespace lichthof::actors {

namespace {

using namespace std::chrono_literals;

using tick_atom = caf::atom_constant<caf::atom("tick")>;

constexpr auto tick = 100ms;
constexpr auto refresh_every = Duration{1'000'000'000}, forget_every = Duration{60'000'000'000};

}  // namespace

void LeadState::begin(caf::event_based_actor* self, LeadOptions options, std::shared_ptr<BlobCache> blobs,
                      Dispatcher dispatcher, std::map<JobId, KeptJob> kept) {
  self_ = self;
  options_ = std::move(options);
  blobs_ = std::move(blobs);
  dispatcher_ = std::move(dispatcher);
  for (auto& [id, job] : kept) jobs_[id].kept = std::move(job);
}

void LeadState::use(const Link& link) {
  link_ = link;
  self_->delayed_send(self_, tick, tick_atom{});
}

void LeadState::end() {
  for (auto& [id, job] : jobs_) keep_columns(id, job);
  for (const auto& [node, known] : nodes_) to_node(node, Dismissed{"the controller is stopping"});
  if (link_) link_->stop();
}

LabView LeadState::view(std::optional<JobId> only) {
  LabView view;
  const Instant now = clock_.now();
  for (const auto& [id, node] : dispatcher_.nodes()) {
    NodeView& seen = view.nodes.emplace_back();
    const KnownNode& known = nodes_[id];
    seen.id = id, seen.node = node, seen.host = known.peer.host, seen.version = known.version;
    seen.report = known.report;
    seen.before = known.before;
    seen.seen_s = 1e-9 * static_cast<double>((now - node.heard).ns);
    for (const auto& counters : link_->monitor().peers())
      if (counters->peer == known.link) seen.bytes_in = counters->bytes_in, seen.bytes_out = counters->bytes_out;
    for (const auto& [job, lab_job] : dispatcher_.jobs())
      if (lab_job.run && lab_job.run->shares.count(id)) seen.jobs.push_back(job);
  }
  for (const auto& [id, lab_job] : dispatcher_.jobs()) {
    if (only && *only != id) continue;
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
    seen.ended_s = job.kept.ended_s;
    seen.seconds = std::max(0.0, (job.kept.ended_s > 0 ? job.kept.ended_s : unix_s()) - job.kept.submitted_s);
  }
  return view;
}

void LeadState::on_tick() {
  const Instant now = clock_.now();
  hear_complaints();
  if ((now - refreshed_).ns >= refresh_every.ns) {
    refreshed_ = now;
    for (auto& [id, job] : jobs_)
      if (job.run) {
        job.run->refresh(now);
        keep_columns(id, job);
        if (job.writings > 0) dispatcher_.still_keeping(id, job.run->epoch(), now);
      }
  }
  if ((now - forgot_).ns >= forget_every.ns) {
    forgot_ = now;
    (void)forget_old();
  }
  step();
}

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
      [self](KeptLight& light) { self->state.on(light); },
      [self](tick_atom) {
        self->state.on_tick();
        self->delayed_send(self, tick, tick_atom{});
      },
  };
}

}  // namespace

}  // namespace lichthof::actors

CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::Errand)
CAF_ALLOW_UNSAFE_MESSAGE_TYPE(lichthof::actors::UseLink)

namespace lichthof::actors {

Expected<std::unique_ptr<Lead>> Lead::start(LeadOptions options) {
  std::unique_ptr<Lead> lead(new Lead);
  std::error_code error;
  for (const char* inside : {"/results", "/columns"})
    std::filesystem::create_directories(options.folder + inside, error);
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
void Lead::fetched(JobId job) {
  ask<bool>([&](LeadState& state) { return state.fetched(job), true; });
}
Status Lead::drain(const std::string& node, bool is_draining) {
  return ask<Status>([&](LeadState& state) { return state.drain(node, is_draining); });
}
Status Lead::kick(const std::string& node) {
  return ask<Status>([&](LeadState& state) { return state.kick(node); });
}
LabView Lead::view(std::optional<JobId> only) {
  return ask<LabView>([&](LeadState& state) { return state.view(only); });
}
Expected<Image> Lead::picture(JobId job) {
  return ask<Expected<Image>>([&](LeadState& state) { return state.picture(job); });
}

}  // namespace lichthof::actors
