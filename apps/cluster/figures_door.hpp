/// Where a node shows its figures: `/metrics` over HTTP and nothing else. In the clear on loopback; beyond it under TLS, to
/// people of the lab.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "actors/link/tls.hpp"
#include "apps/cluster/http_door.hpp"

namespace lichthof::apps {

struct FiguresAddress {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: any free one
};

/// Reads "PORT", "HOST:PORT", "[ADDRESS]:PORT". @error bad_input naming `where`
Expected<FiguresAddress> figures_address(const std::string& text, const std::string& where);

class FiguresDoor {
 public:
  /// @param tls   for addresses beyond loopback
  /// @param text  the figures; called by many threads
  /// @error bad_input: the address is taken or not ours, or lies beyond loopback without TLS
  static Expected<std::unique_ptr<FiguresDoor>> open(const FiguresAddress& address,
                                                     std::shared_ptr<const actors::TlsContext> tls, bool insecure,
                                                     std::function<std::string()> text);
  /// Names under which it may be asked for are this host's and `address.host`.
  FiguresDoor(actors::Socket listening, const FiguresAddress& address, std::shared_ptr<const actors::TlsContext> tls,
              std::function<std::string()> text);
  ~FiguresDoor() { door_.close(); }
  FiguresDoor(const FiguresDoor&) = delete;

  std::uint16_t port() const { return door_.port(); }

 private:
  HttpDoor door_;
};

}  // namespace lichthof::apps
