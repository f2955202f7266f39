/// What a person has written down once about their cluster, in `$XDG_CONFIG_HOME/lichthof/config.toml` or
/// `~/.config/lichthof/config.toml`:
///
///     cluster     = "lab7.example.org:7410"   # the controller
///     authority   = "ca.crt"                  # three files for TLS; names are relative to this file's folder
///     certificate = "anna.crt"
///     key         = "anna.key"
#pragma once

#include <string>

#include "core/base/expected.hpp"

namespace lichthof::io {

struct UserSettings {
  std::string cluster, authority, certificate, key;  ///< empty: not said
};

/// Where the file is looked for; empty when there is neither HOME nor XDG_CONFIG_HOME.
std::string user_settings_path();

/// A missing file says nothing. @error bad_input with file:line: no TOML, a key that is not known, no text
Expected<UserSettings> user_settings(const std::string& path = user_settings_path());

}  // namespace lichthof::io
