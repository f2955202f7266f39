/// Who a process is to the others. Roles stand in certificates and in greetings by name.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lichthof::actors {

enum class Role : std::uint8_t { node, controller, user, viewer };

inline constexpr std::array<std::string_view, 4> role_names{"node", "controller", "user", "viewer"};

inline std::string name_of(Role role) { return std::string(role_names[static_cast<std::size_t>(role)]); }

inline std::optional<Role> role_named(std::string_view name) {
  for (std::size_t i = 0; i < role_names.size(); ++i)
    if (role_names[i] == name) return static_cast<Role>(i);
  return std::nullopt;
}

/// Names go into file names, logs and certificates: 1 to 64 letters, digits and `._-`, the first no dot or dash.
inline bool is_name(std::string_view name) {
  if (name.empty() || name.size() > 64 || name[0] == '.' || name[0] == '-') return false;
  for (const char c : name)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
          c == '-'))
      return false;
  return true;
}

struct Identity {
  std::string name;
  Role role = Role::node;
};

}  // namespace lichthof::actors
