#include "apps/cluster/same_origin.hpp"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>

namespace lichthof::apps {

namespace {

std::string in_small_letters(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "[::1]:80" -> "::1"; empty when it is nothing of the kind.
std::string host_of(const std::string& text) {
  std::string host = text, port;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string::npos) return "";
    host = text.substr(1, end - 1), port = text.substr(end + 1);
  } else if (const std::size_t colon = text.find(':'); colon != std::string::npos) {
    host = text.substr(0, colon), port = text.substr(colon);
  }
  const bool good_port = port.empty() || (port.size() >= 2 && port.size() <= 6 && port[0] == ':' &&
                                          std::all_of(port.begin() + 1, port.end(), [](char c) {
                                            return std::isdigit(static_cast<unsigned char>(c)) != 0;
                                          }));
  return good_port ? in_small_letters(host) : "";
}

/// No name server answers for these: nobody can make them point elsewhere.
bool is_numeric(const std::string& host) {
  in6_addr address{};
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 || ::inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

}  // namespace

std::string foreign_origin(const httplib::Request& request, const std::vector<std::string>& names, bool tls) {
  if (request.get_header_value_count("Host") != 1) return "exactly one Host header is expected";
  const std::string said = request.get_header_value("Host"), host = host_of(said);
  const bool ours =
      is_numeric(host) || host == "localhost" ||
      std::any_of(names.begin(), names.end(), [&](const std::string& name) { return in_small_letters(name) == host; });
  if (host.empty() || !ours) return "this is not the host that the request is for";
  const std::size_t origins = request.get_header_value_count("Origin");
  const std::string origin = in_small_letters(request.get_header_value("Origin"));
  if (origins > 1 || (origins == 1 && origin != (tls ? "https://" : "http://") + in_small_letters(said)))
    return "requests of other sites are refused";
  const std::string site = request.get_header_value("Sec-Fetch-Site");
  if (!site.empty() && site != "same-origin" && site != "none") return "requests of other sites are refused";
  return "";
}

std::vector<std::string> own_names() {
  char name[256] = {};
  if (::gethostname(name, sizeof name - 1) != 0 || !*name) return {};
  const std::string whole = name;
  return {whole, whole.substr(0, whole.find('.'))};
}

}  // namespace lichthof::apps
