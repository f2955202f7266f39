/// Whether a request comes from a page of ours or from no page at all. A browser obeys every web site its user visits: some
/// post to addresses on loopback, some let their own name point there. Both are told by their headers.
#pragma once

#include <httplib.h>

#include <string>
#include <vector>

namespace lichthof::apps {

/// @param names  by which we are called in `Host`, besides localhost and numeric addresses
/// @param tls    whether the request came under TLS
/// @returns empty, or why the request is refused
std::string foreign_origin(const httplib::Request& request, const std::vector<std::string>& names, bool tls);

/// What this machine is called: its host name, with and without domain.
std::vector<std::string> own_names();

}  // namespace lichthof::apps
