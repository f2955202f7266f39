/// `lichthof controller`: the server of a lab. Nodes join it at one port, people reach it at another.
#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "apps/cluster/desk.hpp"
#include "apps/cluster/lab.hpp"
#include "apps/cluster/machine_facts.hpp"
#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"

namespace lichthof::apps {

namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t default_node_port = 7411;

struct ControllerOptions {
  std::string listen = "127.0.0.1", folder, placement = "neighbours", name = "controller";
  std::uint16_t port = default_desk_port, node_port = default_node_port;
  double checkpoint_s = 5;
  RetentionOptions retention;
  double disk_gib = 64;
  std::uint32_t most_waiting = DispatcherOptions().most_waiting_jobs;
  actors::TlsFiles tls;
  bool insecure = false;
  OutputOptions talk;
};

Status run(const ControllerOptions& options, const Interruption& interruption) {
  log_as_asked(options.talk);
  if (!options.talk.quiet && spdlog::get_level() > spdlog::level::info) spdlog::set_level(spdlog::level::info);
  const Interruption::Deferral deferral;
  const bool has_keys = !options.tls.certificate.empty();
  LabOptions lab_options;
  lab_options.version = LICHTHOF_VERSION;
  lab_options.threads = std::max(1u, std::thread::hardware_concurrency());
  actors::LeadOptions& lead = lab_options.lead;
  lead.link.own = {options.name, actors::Role::controller};
  lead.link.version = LICHTHOF_VERSION;
  lead.link.accepted_roles = {actors::Role::node};
  lead.link.max_frame_bytes = 64u << 20;
  lead.link.insecure = options.insecure;
  if (has_keys) lead.link.tls = options.tls;
  lead.host = options.listen, lead.port = options.node_port;
  lead.folder = options.folder.empty() ? state_folder() + "/controller" : options.folder;
  lead.threads = lab_options.threads;
  lead.dispatcher.checkpoint_every = Duration{static_cast<std::int64_t>(1e9 * options.checkpoint_s)};
  lead.dispatcher.heuristic = options.placement == "round-robin"    ? Placement::round_robin
                              : options.placement == "proportional" ? Placement::proportional
                                                                    : Placement::neighbours;
  lead.dispatcher.most_waiting_jobs = options.most_waiting;
  lead.retention = options.retention;
  lead.retention.most_bytes = static_cast<std::uint64_t>(options.disk_gib * (1ull << 30));
  Expected<std::unique_ptr<Lab>> lab = Lab::open(lab_options);
  if (!lab) return lab.error();
  DeskOptions desk_options;
  desk_options.host = options.listen, desk_options.port = options.port;
  desk_options.insecure = options.insecure;
  desk_options.about = {{"version", LICHTHOF_VERSION}, {"nodes_port", (*lab)->port()}};
  if (has_keys) {
    Expected<std::shared_ptr<const actors::TlsContext>> tls = actors::TlsContext::load(options.tls);
    if (!tls) return tls.error();
    desk_options.tls = *tls;
  }
  Expected<std::unique_ptr<Desk>> desk = Desk::open(desk_options, **lab);
  if (!desk) return desk.error();
  if (options.insecure) spdlog::warn("insecure: whoever reaches this machine may join, submit and read");
  if (options.talk.json)
    std::printf("{\"people\": %u, \"nodes\": %u}\n", (*desk)->port(), (*lab)->port());
  else if (!options.talk.quiet)
    std::printf("people: http%s://%s:%u/   nodes: %s:%u   state: %s\n", has_keys ? "s" : "", options.listen.c_str(),
                (*desk)->port(), options.listen.c_str(), (*lab)->port(), lead.folder.c_str());
  std::fflush(stdout);
  for (int looks = 0; !interruption.asked(); ++looks) {
    if (looks % 20 == 0) (*lab)->count();
    std::this_thread::sleep_for(50ms);
  }
  return Done{};
}

}  // namespace

void add_controller(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<ControllerOptions>();
  CLI::App& command = *program.add_subcommand("controller", "serve a lab: nodes join, people submit jobs");
  command.add_option("--listen", options->listen, "address for people and nodes (default 127.0.0.1)")
      ->option_text("HOST");
  command.add_option("--port", options->port, "for people: shell, submit, jobs, top, browsers (default 7410; 0: any)")
      ->option_text("PORT");
  command.add_option("--node-port", options->node_port, "for nodes (default 7411; 0: any)")->option_text("PORT");
  command
      .add_option("--state", options->folder, "folder of jobs and results (default ~/.local/state/lichthof/controller)")
      ->option_text("DIR");
  command.add_option("--placement", options->placement, "of cells onto nodes (default neighbours)")
      ->check(one_of({"neighbours", "proportional", "round-robin"}))
      ->option_text("NAME");
  command.add_option("--checkpoint", options->checkpoint_s, "seconds between checkpoints of a job (default 5)")
      ->check(number_within(0.1, 86400))
      ->option_text("SECONDS");
  const auto keeping = [&](const char* name, auto& value, const char* text, double least, double most,
                           const char* unit) {
    command.add_option(name, value, text)->group("What is kept")->check(number_within(least, most))->option_text(unit);
  };
  keeping("--queue", options->most_waiting, "jobs that may wait; more are refused (default 1000)", 1, 100000, "N");
  keeping("--keep", options->retention.most_jobs, "jobs that have ended; the oldest go (default 2000)", 1, 100000, "N");
  keeping("--keep-disk", options->disk_gib, "size of what they leave behind (default 64)", 0.001, 1e6, "GIB");
  keeping("--keep-days", options->retention.most_days, "age (default 30)", 0.001, 36500, "DAYS");
  keeping("--keep-unfetched", options->retention.unfetched_days,
          "a result that nobody has fetched stays so long whatever the others say (default 7)", 0, 36500, "DAYS");
  command.add_option("--authority", options->tls.authority, "the lab's certificate")->option_text("ca.crt");
  auto* certificate = command.add_option("--certificate", options->tls.certificate, "this controller's certificate")
                          ->option_text("NAME.crt");
  auto* key = command.add_option("--key", options->tls.key, "its key")->option_text("NAME.key");
  certificate->needs("--authority")->needs(key);
  command.add_flag("--insecure", options->insecure,
                   "in the clear beyond this machine; whoever reaches it may do anything");
  add_output_options(command, options->talk);
  command.footer(
      "Beyond this machine nodes and people need certificates of the lab: see lichthof keys.\n"
      "\nExamples:\n"
      "  lichthof controller\n"
      "  lichthof controller --listen 10.0.0.1 --authority keys/ca.crt --certificate keys/lab.crt --key keys/lab.key");
  command.callback(
      [options, &chosen] { chosen = [options](Interruption& interruption) { return run(*options, interruption); }; });
}

}  // namespace lichthof::apps
