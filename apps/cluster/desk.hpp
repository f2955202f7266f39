/// The desk of the controller: what people reach of a cluster over HTTP, in the clear on loopback and otherwise under TLS 1.3
/// with certificates of the lab on both sides. It knows paths, roles and limits; what the answers are, the LabService knows.
///
///     GET   /                              the dashboard
///     GET   /metrics                       for Prometheus
///     GET   /v1/lab                        {"version", "nodes_port", "time_s": since 1970, of the controller's clock}
///     GET   /v1/nodes  /v1/actors  /v1/jobs  /v1/methods
///     GET   /v1/load                       {"nodes", "jobs", "actors"}, of the jobs that are over only the latest
///     GET   /v1/events                     server-sent events: the same each second
///     GET   /v1/jobs/ID  /v1/jobs/ID/log  /v1/jobs/ID/picture.png  /v1/jobs/ID/result/KIND
///     POST  /v1/jobs                       {"scene", "title", "options"}  -> 201 {"id"}
///     POST  /v1/jobs/ID/cancel  /v1/jobs/ID/resume
///     POST  /v1/nodes/NAME/drain           {"on": false} ends it
///     POST  /v1/nodes/NAME/kick
///     HEAD  /v1/scenes/HASH                200 or 404
///     PUT   /v1/scenes/HASH, POST /v1/scenes   the bytes  -> 201 {"hash"}
///
/// Viewers GET; users and the controller may do all; nodes nothing. An error is {"error": one line} under its status.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/cluster/event_feed.hpp"
#include "apps/cluster/http_door.hpp"
#include "apps/cluster/lab_service.hpp"

namespace lichthof::apps {

inline constexpr std::uint16_t default_desk_port = 7410;

struct DeskOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = default_desk_port;  ///< 0: any free one
  std::shared_ptr<const actors::TlsContext> tls;
  bool insecure = false;           ///< in the clear beyond loopback: whoever reaches the port is a user
  std::vector<std::string> names;  ///< by which browsers call this host, besides its own names and addresses
  nlohmann::json about = nlohmann::json::object();  ///< what /v1/lab says besides the time
  DoorLimits door;
  std::uint64_t request_bytes = 1u << 20;  ///< of all bodies but scenes
  int uploads = 2;                         ///< scenes that arrive at a time; each is held in memory
  int event_streams = 64;
  std::chrono::milliseconds event_period{1000};
};

class Desk {
 public:
  /// Listens and serves until it is destroyed. @param service  outlives the desk
  /// @error bad_input: the address is taken or not ours, or lies beyond loopback without TLS
  static Expected<std::unique_ptr<Desk>> open(DeskOptions options, LabService& service);
  ~Desk();
  Desk(const Desk&) = delete;

  std::uint16_t port() const { return door_.port(); }

 private:
  struct Route;
  struct Call;
  using Request = httplib::Request;
  using Response = httplib::Response;

  Desk(actors::Socket listening, DeskOptions options, LabService& service);
  static const std::vector<Route>& routes();
  void install();
  bool admitted(const Request& request, Response& response);
  void answer(const Request& request, Response& response, const httplib::ContentReader* body);
  bool has_body(const Route& route, Call& call, const httplib::ContentReader* body);

  void events(Call& call);
  void submit(Call& call);
  void add_scene(Call& call);
  void drain(Call& call);
  void result(Call& call);

  DeskOptions options_;
  LabService& service_;
  EventFeed feed_;
  std::atomic<int> uploads_{0};
  HttpDoor door_;  // last: its threads use all of the above
};

/// The page at `/`, compiled in. @source web/dashboard.html
extern const char* const dashboard_page;

}  // namespace lichthof::apps
