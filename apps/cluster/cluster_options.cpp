#include "apps/cluster/cluster_options.hpp"

#include <cstdlib>

#include "actors/link/socket.hpp"
#include "io/user_settings.hpp"

namespace lichthof::apps {

void add_cluster_options(CLI::App& command, ClusterOptions& options) {
  const auto add = [&](const char* name, std::string& value, const char* text, const char* placeholder) {
    command.add_option(name, value, text)->group("Cluster")->option_text(placeholder);
  };
  add("--cluster", options.cluster, "the controller (default: LICHTHOF_CLUSTER, else `cluster` in the config file)",
      "HOST:PORT");
  add("--authority", options.authority, "the lab's certificate (default: `authority` in the config file)", "ca.crt");
  add("--certificate", options.certificate, "your certificate (default: `certificate` there)", "NAME.crt");
  add("--key", options.key, "its key (default: `key` there)", "NAME.key");
  command
      .add_flag("--insecure", options.insecure,
                "speak in the clear, also beyond this machine; anybody may listen and alter")
      ->group("Cluster");
}

Expected<ClusterChoice> cluster_choice(const ClusterOptions& options) {
  const std::string path = io::user_settings_path();
  Expected<io::UserSettings> settings = io::user_settings(path);
  if (!settings) return settings.error();
  const char* variable = std::getenv("LICHTHOF_CLUSTER");
  std::string where = "--cluster", name = options.cluster;
  if (name.empty() && variable && *variable) where = "LICHTHOF_CLUSTER", name = variable;
  if (name.empty()) where = path, name = settings->cluster;
  if (name.empty())
    return Error{
        ErrorCode::bad_input, "--cluster",
        "no cluster is named: give HOST:PORT, set LICHTHOF_CLUSTER, or write cluster = \"HOST:PORT\" into " + path};
  Expected<DeskAddress> address = desk_address(name, where);
  if (!address) return address.error();

  const auto chosen = [](const std::string& given, const std::string& written) {
    return given.empty() ? written : given;
  };
  const actors::TlsFiles files{chosen(options.authority, settings->authority),
                               chosen(options.certificate, settings->certificate), chosen(options.key, settings->key)};
  const bool is_near = actors::is_loopback(address->host);
  if (options.insecure || (is_near && files.certificate.empty())) return ClusterChoice{*address, files, true};
  if (files.authority.empty() || files.certificate.empty() || files.key.empty())
    return Error{
        ErrorCode::bad_input, name,
        "beyond this machine certificates are needed: give --authority, --certificate and --key, or write them "
        "into " +
            path};
  return ClusterChoice{*address, files, false};
}

Expected<DeskClient> desk_client(const ClusterOptions& options) {
  Expected<ClusterChoice> choice = cluster_choice(options);
  if (!choice) return choice.error();
  if (choice->is_clear) return DeskClient(choice->address);
  Expected<std::shared_ptr<const actors::TlsContext>> tls = actors::TlsContext::load(choice->files);
  if (!tls) return tls.error();
  choice->address.tls = *tls;
  return DeskClient(choice->address);
}

}  // namespace lichthof::apps
