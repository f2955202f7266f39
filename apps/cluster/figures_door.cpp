#include "apps/cluster/figures_door.hpp"

#include <charconv>

#include "apps/cluster/figures.hpp"
#include "apps/cluster/same_origin.hpp"

namespace lichthof::apps {

namespace {

/// Few read figures, and they ask for little.
DoorLimits limits() {
  DoorLimits few;
  few.connections = 16, few.head_bytes = 8192, few.body_bytes = 0;
  return few;
}

}  // namespace

Expected<FiguresAddress> figures_address(const std::string& text, const std::string& where) {
  const Error wrong{ErrorCode::bad_input, where, "PORT or HOST:PORT was expected, for example 9464 or 10.0.0.7:9464"};
  FiguresAddress address;
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (colon != std::string::npos) {
    address.host = text.substr(0, colon);
    const bool is_in_brackets = address.host.starts_with('[') && address.host.ends_with(']');
    if (is_in_brackets) address.host = address.host.substr(1, address.host.size() - 2);
    const bool has_colon = address.host.find(':') != std::string::npos;
    if (address.host.empty() || address.host.size() > 253 || has_colon != is_in_brackets ||
        address.host.find_first_of(" /\t\r\n@[]") != std::string::npos)
      return wrong;
  }
  const auto [end, problem] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (port.empty() || problem != std::errc() || end != port.data() + port.size()) return wrong;
  return address;
}

Expected<std::unique_ptr<FiguresDoor>> FiguresDoor::open(const FiguresAddress& address,
                                                         std::shared_ptr<const actors::TlsContext> tls, bool insecure,
                                                         std::function<std::string()> text) {
  const bool is_near = actors::is_loopback(address.host);
  if (!is_near && !tls && !insecure)
    return Error{ErrorCode::bad_input, actors::endpoint(address.host, address.port),
                 "beyond loopback figures are shown only with certificates (lichthof keys), or with --insecure"};
  Expected<actors::Socket> listening = actors::listening_socket(address.host, address.port);
  if (!listening) return listening.error();
  return std::make_unique<FiguresDoor>(std::move(*listening), address, is_near ? nullptr : std::move(tls),
                                       std::move(text));
}

FiguresDoor::FiguresDoor(actors::Socket listening, const FiguresAddress& address,
                         std::shared_ptr<const actors::TlsContext> tls, std::function<std::string()> text)
    : door_(std::move(listening), tls, {"anybody", actors::Role::viewer}, limits()) {
  std::vector<std::string> names = own_names();
  names.push_back(address.host);
  using Outcome = httplib::Server::HandlerResponse;
  door_.set_pre_routing_handler(
      [names, is_tls = tls != nullptr](const httplib::Request& request, httplib::Response& response) {
        const std::string foreign = foreign_origin(request, names, is_tls);
        const bool is_node = HttpDoor::caller().role == actors::Role::node;
        if (foreign.empty() && !is_node) return Outcome::Unhandled;
        response.status = 403;
        response.set_content((is_node ? "a node's certificate opens nothing here" : foreign) + "\n", "text/plain");
        return Outcome::Handled;
      });
  door_.Get("/metrics", [text = std::move(text)](const httplib::Request&, httplib::Response& response) {
    response.set_content(text(), figures_type);
  });
  door_.open();
}

}  // namespace lichthof::apps
