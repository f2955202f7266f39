/// `lichthof node`: the daemon on a workstation. It joins a controller and works for it.
#include "actors/cluster/node.hpp"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/cluster/desk_client.hpp"
#include "apps/cluster/figures.hpp"
#include "apps/cluster/figures_door.hpp"
#include "apps/cluster/machine_facts.hpp"
#include "apps/cluster/owner_watch.hpp"
#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "io/solution_file.hpp"

namespace lichthof::apps {

namespace {

struct NodeCommand {
  std::string join, listen = "127.0.0.1", name, cache;
  std::uint16_t port = 0;
  unsigned threads = 0;
  double memory_gib = 0;
  std::string metrics;
  bool idle_only = false;
  double idle_minutes = 5, others_cores = PresenceOptions{}.busy_cores;
  std::vector<std::string> owner_files;
  actors::TlsFiles tls;
  bool insecure = false;
  OutputOptions talk;
};

Duration seconds(double s) { return {static_cast<std::int64_t>(1e9 * s)}; }

/// @returns null where none is asked for
Expected<std::unique_ptr<FiguresDoor>> figures_door(const NodeCommand& command, NodeFigures& figures) {
  if (command.metrics.empty()) return std::unique_ptr<FiguresDoor>();
  const Expected<FiguresAddress> address = figures_address(command.metrics, "--metrics");
  if (!address) return address.error();
  std::shared_ptr<const actors::TlsContext> tls;
  if (!command.tls.certificate.empty()) {
    Expected<std::shared_ptr<const actors::TlsContext>> loaded = actors::TlsContext::load(command.tls);
    if (!loaded) return loaded.error();
    tls = *loaded;
  }
  Expected<std::unique_ptr<FiguresDoor>> door =
      FiguresDoor::open(*address, tls, command.insecure, [&figures] { return figures.text(); });
  if (door) spdlog::info("figures: {}", actors::endpoint(address->host, (*door)->port()) + "/metrics");
  return door;
}

Status run(const NodeCommand& command, const Interruption& interruption) {
  log_as_asked(command.talk);
  if (!command.talk.quiet && spdlog::get_level() > spdlog::level::info) spdlog::set_level(spdlog::level::info);
  const Interruption::Deferral deferral;
  if (command.idle_only) yield_to_everybody();
  const std::string join = command.join.find(':') == std::string::npos ? command.join + ":7411" : command.join;
  const Expected<DeskAddress> lead = desk_address(join, "--join");
  if (!lead) return lead.error();
  actors::NodeOptions options;
  options.threads = command.threads > 0 ? command.threads : std::max(1u, std::thread::hardware_concurrency());
  options.link.own = {command.name.empty() ? machine_name() : command.name, actors::Role::node};
  options.link.version = LICHTHOF_VERSION;
  options.link.accepted_roles = {actors::Role::node};
  options.link.max_frame_bytes = 64u << 20;
  options.link.insecure = command.insecure;
  if (!command.tls.certificate.empty()) options.link.tls = command.tls;
  options.listen_host = command.listen, options.listen_port = command.port;
  options.lead_host = lead->host, options.lead_port = lead->port;
  options.cache = (command.cache.empty() ? cache_folder() : command.cache) + "/node-" + options.link.own.name;
  options.facts.cores = options.threads;
  options.facts.memory_bytes =
      command.memory_gib > 0 ? static_cast<std::uint64_t>(command.memory_gib * (1ull << 30)) : total_memory_bytes();
  options.facts.rays_per_s = measured_rays_per_s();
  options.read_solution = io::read_solution;
  options.abandon = [] {
    spdlog::warn("left while a run was being loaded");
    spdlog::shutdown();
    std::_Exit(0);  // static objects stay: the thread that loads uses them
  };
  options.free_memory_bytes = free_memory_bytes, options.used_memory_bytes = used_memory_bytes;
  spdlog::info("{}: {} threads, {:.1f} Mray/s each", options.link.own.name, options.threads,
               options.facts.rays_per_s / 1e6);
  NodeFigures figures(LICHTHOF_VERSION, options.counters);
  const Expected<std::unique_ptr<FiguresDoor>> door = figures_door(command, figures);
  if (!door) return door.error();
  std::optional<OwnerWatch> owner;
  if (command.idle_only) {
    owner.emplace(OwnerWatchOptions{
        {seconds(60 * command.idle_minutes), command.others_cores, PresenceOptions{}.busy_for}, command.owner_files});
    options.may_work = [&owner] { return owner->is_away(); };
    spdlog::info("works while the owner has been away for {:g} min", command.idle_minutes);
  }
  return actors::run_node(options, interruption.asked());
}

}  // namespace

void add_node(CLI::App& program, Command& chosen) {
  auto node = std::make_shared<NodeCommand>();
  CLI::App& command = *program.add_subcommand("node", "work for a lab's controller, on this machine");
  command.add_option("--join", node->join, "the controller; port 7411 unless said")
      ->required()
      ->option_text("HOST[:PORT]");
  command.add_option("--listen", node->listen, "address where other nodes reach this one (default 127.0.0.1)")
      ->option_text("HOST");
  command.add_option("--port", node->port, "and port (default: any free one)")->option_text("PORT");
  command.add_option("--name", node->name, "in lists and logs (default: the host's); a certificate's goes before")
      ->check(
          [](const std::string& name) { return actors::is_name(name) ? "" : "is no name: letters, digits and ._-"; })
      ->option_text("NAME");
  command.add_option("--threads", node->threads, "cores to use (default: all)")
      ->check(number_within(1, 4096))
      ->option_text("N");
  command.add_option("--memory", node->memory_gib, "memory to offer (default: all)")
      ->check(number_within(0.1, 1e6))
      ->option_text("GIB");
  command.add_option("--cache", node->cache, "folder for what the controller hands out (default ~/.cache/lichthof)")
      ->option_text("DIR");
  command.add_flag("--idle-only", node->idle_only,
                   "work only while the machine's owner is away, and yield at once when he is back");
  command.add_option("--idle-after", node->idle_minutes, "minutes without a sign of him (default 5)")
      ->check(number_within(0.01, 10080))
      ->needs("--idle-only")
      ->option_text("MINUTES");
  command
      .add_option("--idle-cores", node->others_cores,
                  "more cores used by programs of others are a sign of him (default 0.5; 0: not looked at)")
      ->check(number_within(0, 4096))
      ->needs("--idle-only")
      ->option_text("N");
  command
      .add_option("--owner-files", node->owner_files,
                  "look at the access times of these instead of terminals, input devices and desktops")
      ->needs("--idle-only")
      ->option_text("PATTERN");
  command.add_option("--metrics", node->metrics, "show figures to Prometheus (default host 127.0.0.1)")
      ->check([](const std::string& text) {
        const Expected<FiguresAddress> address = figures_address(text, "");
        return address ? std::string() : address.error().message;
      })
      ->option_text("[HOST:]PORT");
  command.add_option("--authority", node->tls.authority, "the lab's certificate")->option_text("ca.crt");
  auto* certificate =
      command.add_option("--certificate", node->tls.certificate, "this node's certificate")->option_text("NAME.crt");
  auto* key = command.add_option("--key", node->tls.key, "its key")->option_text("NAME.key");
  certificate->needs("--authority")->needs(key);
  command.add_flag("--insecure", node->insecure, "in the clear beyond this machine");
  add_output_options(command, node->talk);
  command.footer(
      "The node dials its controller until it answers, and again when it was gone.\n"
      "\nExamples:\n"
      "  lichthof node --join localhost\n"
      "  lichthof node --join localhost --idle-only --metrics 9464\n"
      "  lichthof node --join lab.example.org --listen 10.0.0.7 --authority ca.crt --certificate node7.crt --key "
      "node7.key");
  command.callback(
      [node, &chosen] { chosen = [node](Interruption& interruption) { return run(*node, interruption); }; });
}

}  // namespace lichthof::apps
