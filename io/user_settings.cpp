#include "io/user_settings.hpp"

#include <toml++/toml.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "io/text.hpp"

namespace lichthof::io {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t most_bytes = 65536;

struct Field {
  const char* key;
  std::string UserSettings::*text;
  bool is_file;
};
constexpr std::array<Field, 4> fields{{{"cluster", &UserSettings::cluster, false},
                                       {"authority", &UserSettings::authority, true},
                                       {"certificate", &UserSettings::certificate, true},
                                       {"key", &UserSettings::key, true}}};

}  // namespace

std::string user_settings_path() {
  const char* base = std::getenv("XDG_CONFIG_HOME");
  if (base && *base == '/') return std::string(base) + "/lichthof/config.toml";
  const char* home = std::getenv("HOME");
  return home && *home ? std::string(home) + "/.config/lichthof/config.toml" : "";
}

Expected<UserSettings> user_settings(const std::string& path) {
  UserSettings settings;
  std::error_code ignored;
  if (path.empty() || !fs::exists(path, ignored)) return settings;
  Expected<std::string> text = file_text(path, most_bytes);
  if (!text) return text.error();
  toml::table table;
  try {
    table = toml::parse(*text, path);
  } catch (const toml::parse_error& problem) {
    return bad_input(at_line(path, problem.source().begin.line), printable(problem.description()));
  }
  for (const auto& [key, value] : table) {
    const std::uint64_t line = key.source().begin.line;
    const Field* field = nullptr;
    for (const Field& candidate : fields)
      if (key.str() == candidate.key) field = &candidate;
    if (!field)
      return bad_input(at_line(path, line), in_quotes(key.str()) + " is none of cluster, authority, certificate, key");
    const auto said = value.value<std::string>();
    if (!said) return bad_input(at_line(path, line), std::string(field->key) + " is no text in quotes");
    const bool relative = field->is_file && !said->empty() && fs::path(*said).is_relative();
    settings.*(field->text) = relative ? (fs::path(path).parent_path() / *said).string() : *said;
  }
  return settings;
}

}  // namespace lichthof::io
