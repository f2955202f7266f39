/// `lichthof jobs`: what a cluster works on, and single words to one job.
#include <memory>
#include <string>

#include "apps/cluster/actions.hpp"
#include "apps/cluster/cluster_options.hpp"
#include "apps/commands.hpp"
#include "apps/common/log.hpp"

namespace lichthof::apps {

namespace {

struct JobsOptions {
  std::uint64_t job = 0;  ///< 0: all
  std::string output;
  std::optional<double> exposure_ev;
  ClusterOptions cluster;
  OutputOptions talk;
};

using Action = Status (*)(const DeskClient&, const JobsOptions&, const Interruption&);

Command command_of(const std::shared_ptr<JobsOptions>& options, Action action) {
  return [options, action](Interruption& interruption) -> Status {
    log_as_asked(options->talk);
    const Expected<DeskClient> client = desk_client(options->cluster);
    if (!client) return client.error();
    return action(*client, *options, interruption);
  };
}

CLI::Option* add_id(CLI::App& command, JobsOptions& options) {
  return command.add_option("ID", options.job, "number of a job")->check(number_within(1, 1e18))->option_text(" ");
}

CLI::App& add_action(CLI::App& command, const std::shared_ptr<JobsOptions>& options, Command& chosen,
                     const std::string& name, const std::string& text, Action action) {
  CLI::App& added = *command.add_subcommand(name, text);
  add_id(added, *options)->required();
  add_cluster_options(added, options->cluster);
  add_output_options(added, options->talk);
  added.footer("\nExample:\n  lichthof jobs " + name + " 12" + (name == "result" ? " -o room.png" : ""));
  added.callback([options, &chosen, action] { chosen = command_of(options, action); });
  return added;
}

}  // namespace

void add_jobs(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<JobsOptions>();
  CLI::App& command =
      *program.add_subcommand("jobs", "list a cluster's jobs, follow, cancel, resume them, fetch results");
  command.require_subcommand(0, 1);
  add_id(command, *options);
  add_action(command, options, chosen, "cancel", "end a job",
             [](const DeskClient& client, const JobsOptions& o, const Interruption&) {
               return cancel_job(client, o.job, o.talk);
             });
  add_action(command, options, chosen, "resume", "go on with a job that ended early",
             [](const DeskClient& client, const JobsOptions& o, const Interruption&) {
               return resume_job(client, o.job, o.talk);
             });
  add_action(command, options, chosen, "watch", "follow a job to its end",
             [](const DeskClient& client, const JobsOptions& o, const Interruption& interruption) {
               return watch_job(client, o.job, o.talk, interruption);
             });
  add_action(command, options, chosen, "log", "what happened to a job",
             [](const DeskClient& client, const JobsOptions& o, const Interruption&) {
               return show_log(client, o.job, o.talk);
             });
  CLI::App& result = add_action(command, options, chosen, "result", "fetch what a job made",
                                [](const DeskClient& client, const JobsOptions& o, const Interruption&) {
                                  return fetch_result(client, o.job, o.output, o.exposure_ev, o.talk);
                                });
  result.add_option("-o,--output", options->output, "the picture as .exr, .hdr or .png, or the solution as .lht")
      ->required()
      ->option_text("FILE");
  add_exposure_option(result, options->exposure_ev, "a .png");
  add_cluster_options(command, options->cluster);
  add_output_options(command, options->talk);
  command.footer(
      "Exit status of watch: 0 when the job is done, 1 when it failed, was cancelled, or is watched no more.\n"
      "\nExamples:\n"
      "  lichthof jobs --cluster lab7:7410\n"
      "  lichthof jobs 12\n"
      "  lichthof jobs watch 12 && lichthof jobs result 12 -o room.exr\n"
      "  lichthof jobs --json");
  command.callback([options, &chosen, &command] {
    if (!command.get_subcommands().empty()) return;
    chosen = command_of(options, [](const DeskClient& client, const JobsOptions& o, const Interruption&) {
      return o.job == 0 ? show_jobs(client, o.talk) : show_job(client, o.job, o.talk);
    });
  });
}

}  // namespace lichthof::apps
