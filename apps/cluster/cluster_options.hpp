/// Which cluster a command speaks to: the command line goes before LICHTHOF_CLUSTER, that before the user's config file.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/cluster/desk_client.hpp"

namespace lichthof::apps {

struct ClusterOptions {
  std::string cluster, authority, certificate, key;
  bool insecure = false;
};

/// Adds --cluster --authority --certificate --key --insecure.
void add_cluster_options(CLI::App& command, ClusterOptions& options);

/// What has been chosen; nothing has been read but the config file.
struct ClusterChoice {
  DeskAddress address;
  actors::TlsFiles files;
  bool is_clear = false;  ///< without TLS: on this machine where no certificate is named, or --insecure
};
/// @error bad_input: no cluster is named anywhere, no good name, beyond this machine and no certificate
Expected<ClusterChoice> cluster_choice(const ClusterOptions& options);

/// TLS beyond loopback, and wherever a certificate is named, unless --insecure.
/// @error bad_input: as cluster_choice; certificates missing or damaged
Expected<DeskClient> desk_client(const ClusterOptions& options);

}  // namespace lichthof::apps
