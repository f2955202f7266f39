/// `lichthof keys`: the certificates by which the processes of a cluster know each other.
#include "actors/link/keys.hpp"

#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/common/interruption.hpp"
#include "apps/common/log.hpp"
#include "apps/common/report.hpp"

namespace lichthof::apps {

namespace {

using actors::CertificateFacts;

struct KeysOptions {
  std::string path, name, role;
  int days = static_cast<int>(actors::issued_validity.to_s / actors::day_s);
  OutputOptions talk;
};

nlohmann::json json(const CertificateFacts& facts) {
  return {{"file", facts.file},
          {"name", facts.name},
          {"role", facts.role},
          {"issuer", facts.issuer},
          {"valid_from", facts.valid_from},
          {"valid_to", facts.valid_to},
          {"sha256", facts.fingerprint},
          {"problem", facts.problem}};
}

Status report(const OutputOptions& talk, const std::string& action, const std::string& path,
              std::vector<std::string> lines) {
  const Expected<std::vector<CertificateFacts>> all = actors::certificate_facts(path);
  if (!all) return all.error();
  nlohmann::json certificates = nlohmann::json::array();
  for (const CertificateFacts& facts : *all) {
    certificates.push_back(json(facts));
    lines.push_back(facts.file + ": " + facts.role + " " + facts.name + ", valid to " + facts.valid_to +
                    (facts.problem.empty() ? "" : " (" + facts.problem + ")") + ", SHA-256 " +
                    facts.fingerprint.substr(0, 16));
  }
  const nlohmann::json document = {{"command", "keys"},
                                   {"action", action},
                                   {"version", LICHTHOF_VERSION},
                                   {"certificates", std::move(certificates)}};
  return print(talk, document, lines);
}

Status init(const KeysOptions& options) {
  log_as_asked(options.talk);
  const Interruption::Deferral deferral;
  if (Status made = actors::create_authority(options.path); !made) return made;
  return report(options.talk, "init", options.path + "/ca.crt",
                {"keep " + options.path + "/ca.key to yourself: whoever has it can let anybody in"});
}

Status issue(const KeysOptions& options) {
  log_as_asked(options.talk);
  const Interruption::Deferral deferral;
  actors::Validity validity = actors::issued_validity;
  validity.to_s = options.days * actors::day_s;
  if (Status made =
          actors::issue_certificate(options.path, {options.name, *actors::role_named(options.role)}, validity);
      !made)
    return made;
  return report(options.talk, "issue", options.path + "/" + options.name + ".crt", {});
}

Status revoke(const KeysOptions& options) {
  log_as_asked(options.talk);
  const Interruption::Deferral deferral;
  if (Status made = actors::revoke_certificate(options.path, options.name); !made) return made;
  const std::string list = options.path + "/ca.crl";
  return report(options.talk, "revoke", options.path + "/" + options.name + ".crt",
                {"copy " + list + " beside ca.crt on the controller and the nodes; they notice by themselves"});
}

Status show(const KeysOptions& options) {
  log_as_asked(options.talk);
  return report(options.talk, "show", options.path, {});
}

CLI::App& add_action(CLI::App& command, const std::shared_ptr<KeysOptions>& options, Command& chosen,
                     const std::string& name, const std::string& text, Status (*action)(const KeysOptions&)) {
  CLI::App& added = *command.add_subcommand(name, text);
  added.callback(
      [options, &chosen, action] { chosen = [options, action](Interruption&) { return action(*options); }; });
  add_output_options(added, options->talk);
  return added;
}

}  // namespace

void add_keys(CLI::App& program, Command& chosen) {
  auto options = std::make_shared<KeysOptions>();
  CLI::App& command = *program.add_subcommand("keys", "make and show the certificates of a cluster");
  command.require_subcommand(1);
  CLI::App& init_command =
      add_action(command, options, chosen, "init", "make the lab's authority in a new folder", init);
  init_command.add_option("DIR", options->path, "folder for ca.crt and ca.key")->required()->option_text(" ");
  CLI::App& issue_command = add_action(command, options, chosen, "issue", "issue a certificate and its key", issue);
  issue_command.add_option("DIR", options->path, "folder of the authority")->required()->option_text(" ");
  issue_command.add_option("--name", options->name, "of the machine or person; also of the files")
      ->required()
      ->option_text("NAME");
  issue_command.add_option("--role", options->role, "node, controller, user or viewer")
      ->required()
      ->check(one_of({actors::role_names.begin(), actors::role_names.end()}))
      ->option_text("ROLE");
  issue_command.add_option("--days", options->days, "valid for so many days (default 730)")
      ->check(number_within(1, 3650))
      ->option_text("N");
  CLI::App& revoke_command =
      add_action(command, options, chosen, "revoke", "take a certificate back: its holder is let in no more", revoke);
  revoke_command.add_option("DIR", options->path, "folder of the authority")->required()->option_text(" ");
  revoke_command.add_option("--name", options->name, "whose certificate")->required()->option_text("NAME");
  CLI::App& show_command = add_action(command, options, chosen, "show", "say what stands in certificates", show);
  show_command.add_option("PATH", options->path, "a certificate, or a folder of them")->required()->option_text(" ");
  command.footer(
      "A process gets ca.crt and its own pair; ca.key stays where it was made. Files are never overwritten.\n"
      "What is revoked stands in ca.crl. Controller and nodes read it where it lies beside their ca.crt, at once when "
      "it\n"
      "changes, and part with whoever stands in it. After that a new certificate may be issued to the same name.\n"
      "\nExamples:\n"
      "  lichthof keys init keys\n"
      "  lichthof keys issue keys --name node1 --role node\n"
      "  lichthof keys revoke keys --name node1\n"
      "  lichthof keys show keys");
}

}  // namespace lichthof::apps
