#include "apps/cluster/desk.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "actors/link/digest.hpp"
#include "apps/cluster/figures.hpp"
#include "apps/cluster/same_origin.hpp"

namespace lichthof::apps {

namespace {

using Request = httplib::Request;
using Response = httplib::Response;

constexpr std::size_t longest_path = 512;
constexpr int deepest_json = 16;
constexpr const char* json_type = "application/json";

/// The page is one file and fetches from nowhere but here.
constexpr const char* page_policy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

void send(Response& response, int status, const nlohmann::json& document) {
  response.status = status;
  response.set_content(text_of(document), json_type);
}

void refuse(Response& response, int status, const std::string& why) { send(response, status, {{"error", why}}); }

/// @param named  the request names a job or node: bad input means that there is none
void refuse(Response& response, const Error& error, bool named) {
  const int status = error.code == ErrorCode::bad_input     ? (named ? 404 : 400)
                     : error.code == ErrorCode::failed      ? 409
                     : error.code == ErrorCode::interrupted ? 503
                                                            : 500;
  refuse(response, status, error.text());
}

std::vector<std::string_view> segments(std::string_view path) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t end = std::min(path.find('/', at + 1), path.size());
    parts.push_back(path.substr(at + 1, end - at - 1));
    at = end;
  }
  return parts;
}

/// "v1/jobs/*/log"; what stands for the stars goes to `arguments`.
bool fits(std::string_view pattern, std::string_view path, std::vector<std::string>& arguments) {
  const auto wanted = segments(pattern), given = segments(path);
  arguments.clear();
  if (wanted.size() != given.size()) return false;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == "*" && !given[i].empty())
      arguments.emplace_back(given[i]);
    else if (wanted[i] != given[i])
      return false;
  }
  return true;
}

bool is_digest(const std::string& text) {
  return text.size() == 64 &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

/// A document, unless it is nested so deep that whoever walks it would run out of stack.
std::optional<nlohmann::json> document_in(const std::string& text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (quoted && text[i] == '\\') ++i;
    if (quoted) continue;
    depth += (text[i] == '[' || text[i] == '{') - (text[i] == ']' || text[i] == '}');
    if (depth > deepest_json) return std::nullopt;
  }
  nlohmann::json document = nlohmann::json::parse(text, nullptr, false);
  if (document.is_discarded()) return std::nullopt;
  return document;
}

/// What is wrong with how a body is announced; 0: nothing.
int body_fault(const Request& request, std::string& why) {
  if (request.has_header("Transfer-Encoding")) return why = "a body needs a Content-Length", 411;
  if (request.has_header("Content-Encoding")) return why = "compressed bodies are not read", 415;
  const std::string length = request.get_header_value("Content-Length");
  if (request.get_header_value_count("Content-Length") > 1 || length.size() > 18 ||
      !std::all_of(length.begin(), length.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return why = "Content-Length is one number", 400;
  if (length.empty() || std::stoull(length) == 0) return 0;
  if (request.method != "POST" && request.method != "PUT") return why = "this method takes no body", 400;
  const std::string type = request.get_header_value("Content-Type");
  if (!type.starts_with(json_type) && type != "application/octet-stream")
    return why = "a body is application/json or application/octet-stream", 415;
  return 0;
}

}  // namespace

struct Desk::Call {
  const Request& request;
  Response& response;
  std::vector<std::string> arguments;
  std::string body;

  std::uint64_t job() const {
    std::uint64_t id = 0;
    const std::string& text = arguments[0];
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), id);
    return problem == std::errc() && end == text.data() + text.size() ? id : 0;
  }
  void give(const nlohmann::json& document) { send(response, 200, document); }
  void give(const Expected<nlohmann::json>& document) {
    document ? give(*document) : refuse(response, document.error(), true);
  }
  void give(const Status& status) {
    status ? give(nlohmann::json{{"done", true}}) : refuse(response, status.error(), true);
  }
  void give(Expected<std::string> bytes, const char* type) {
    if (!bytes) return refuse(response, bytes.error(), true);
    response.status = 200;
    response.body = std::move(*bytes);
    response.set_header("Content-Type", type);
  }
};

struct Desk::Route {
  const char* method;
  const char* pattern;
  enum class Body { none, document, scene } body;
  void (*handler)(Desk&, Call&);
};

const std::vector<Desk::Route>& Desk::routes() {
  using B = Route::Body;
  static const std::vector<Route> table = {
      {"GET", "/", B::none,
       [](Desk&, Call& call) {
         call.response.set_header("Content-Security-Policy", page_policy);
         call.give(std::string(dashboard_page), "text/html; charset=utf-8");
       }},
      {"GET", "/metrics", B::none, [](Desk& d, Call& call) { call.give(d.service_.metrics(), figures_type); }},
      {"GET", "/v1/lab", B::none,
       [](Desk& d, Call& call) {
         nlohmann::json lab = d.options_.about;
         lab["time_s"] = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
         call.give(lab);
       }},
      {"GET", "/v1/nodes", B::none, [](Desk& d, Call& call) { call.give(d.service_.nodes()); }},
      {"GET", "/v1/actors", B::none, [](Desk& d, Call& call) { call.give(d.service_.actors()); }},
      {"GET", "/v1/load", B::none, [](Desk& d, Call& call) { call.give(load_of(d.service_)); }},
      {"GET", "/v1/jobs", B::none, [](Desk& d, Call& call) { call.give(d.service_.jobs()); }},
      {"GET", "/v1/methods", B::none, [](Desk& d, Call& call) { call.give(d.service_.methods()); }},
      {"GET", "/v1/events", B::none, [](Desk& d, Call& call) { d.events(call); }},
      {"GET", "/v1/jobs/*", B::none, [](Desk& d, Call& call) { call.give(d.service_.job(call.job())); }},
      {"GET", "/v1/jobs/*/log", B::none,
       [](Desk& d, Call& call) { call.give(d.service_.log(call.job()), "text/plain; charset=utf-8"); }},
      {"GET", "/v1/jobs/*/picture.png", B::none,
       [](Desk& d, Call& call) { call.give(d.service_.picture_so_far(call.job()), "image/png"); }},
      {"GET", "/v1/jobs/*/result/*", B::none, [](Desk& d, Call& call) { d.result(call); }},
      {"GET", "/v1/scenes/*", B::none,
       [](Desk& d, Call& call) {
         if (!is_digest(call.arguments[0]) || !d.service_.has_scene(call.arguments[0]))
           return refuse(call.response, 404, "no such scene");
         call.give(nlohmann::json{{"hash", call.arguments[0]}});
       }},
      {"POST", "/v1/jobs", B::document, [](Desk& d, Call& call) { d.submit(call); }},
      {"POST", "/v1/jobs/*/cancel", B::document, [](Desk& d, Call& call) { call.give(d.service_.cancel(call.job())); }},
      {"POST", "/v1/jobs/*/resume", B::document, [](Desk& d, Call& call) { call.give(d.service_.resume(call.job())); }},
      {"POST", "/v1/nodes/*/drain", B::document, [](Desk& d, Call& call) { d.drain(call); }},
      {"POST", "/v1/nodes/*/kick", B::document,
       [](Desk& d, Call& call) { call.give(d.service_.kick(call.arguments[0])); }},
      {"POST", "/v1/scenes", B::scene, [](Desk& d, Call& call) { d.add_scene(call); }},
      {"PUT", "/v1/scenes/*", B::scene, [](Desk& d, Call& call) { d.add_scene(call); }},
  };
  return table;
}

Expected<std::unique_ptr<Desk>> Desk::open(DeskOptions options, LabService& service) {
  const bool is_near = actors::is_loopback(options.host);
  if (!is_near && !options.tls && !options.insecure)
    return Error{ErrorCode::bad_input, actors::endpoint(options.host, options.port),
                 "beyond loopback people are served only with certificates (lichthof keys), or with --insecure"};
  Expected<actors::Socket> listening = actors::listening_socket(options.host, options.port);
  if (!listening) return listening.error();
  return std::unique_ptr<Desk>(new Desk(std::move(*listening), std::move(options), service));
}

Desk::Desk(actors::Socket listening, DeskOptions options, LabService& service)
    : options_(std::move(options)), service_(service), feed_(service, options_.event_streams, options_.event_period),
      door_(std::move(listening), options_.tls,
            {actors::is_loopback(options_.host) ? "local" : "anybody", actors::Role::user}, options_.door) {
  const std::vector<std::string> own = own_names();
  options_.names.insert(options_.names.end(), own.begin(), own.end());
  options_.names.push_back(options_.host);
  install();
  door_.open();
}

Desk::~Desk() {
  feed_.stop();
  door_.close();
}

void Desk::install() {
  door_.set_default_headers({{"Cache-Control", "no-store"},
                             {"X-Content-Type-Options", "nosniff"},
                             {"X-Frame-Options", "DENY"},
                             {"Referrer-Policy", "no-referrer"},
                             {"Cross-Origin-Resource-Policy", "same-origin"}});
  using Outcome = httplib::Server::HandlerResponse;
  door_.set_pre_routing_handler([this](const Request& request, Response& response) {
    return admitted(request, response) ? Outcome::Unhandled : Outcome::Handled;
  });
  door_.set_expect_100_continue_handler([this](const Request& request, Response& response) {
    return admitted(request, response) ? 100 : response.status;
  });
  door_.set_error_handler(httplib::Server::HandlerWithResponse([](const Request&, Response& response) {
    if (response.body.empty()) refuse(response, response.status, "this is no request that can be understood");
    return Outcome::Handled;
  }));
  door_.set_exception_handler([](const Request&, Response& response, const std::exception_ptr&) {
    refuse(response, 500, "internal error: the answer could not be made");
  });
  door_.Get(".*", [this](const Request& request, Response& response) { answer(request, response, nullptr); });
  const auto with_body = [this](const Request& request, Response& response, const httplib::ContentReader& body) {
    answer(request, response, &body);
  };
  door_.Post(".*", with_body);
  door_.Put(".*", with_body);
}

bool Desk::admitted(const Request& request, Response& response) {
  const auto no = [&response](int status, const std::string& why) { return refuse(response, status, why), false; };
  if (request.path.size() > longest_path) return no(414, "the path is too long");
  if (const std::string foreign = foreign_origin(request, options_.names, options_.tls != nullptr); !foreign.empty())
    return no(403, foreign);
  const bool reads = request.method == "GET" || request.method == "HEAD";
  const Caller& caller = HttpDoor::caller();
  if (caller.role == actors::Role::node) return no(403, "a node's certificate opens nothing here; use a person's");
  const Route* route = nullptr;
  bool known = false;
  std::vector<std::string> ignored;
  for (const Route& candidate : routes()) {
    if (!fits(candidate.pattern, request.path, ignored)) continue;
    known = true;
    if (candidate.method == (reads ? "GET" : request.method)) route = &candidate;
  }
  if (!known) return no(404, "there is nothing at this path");
  if (!route) return no(405, "this path does not take " + request.method.substr(0, 16));
  if (!reads && caller.role == actors::Role::viewer) return no(403, "a viewer may look, but change nothing");
  std::string why;
  if (const int fault = body_fault(request, why); fault != 0) return no(fault, why);
  const std::string length = request.get_header_value("Content-Length");
  const std::uint64_t most = route->body == Route::Body::scene ? options_.door.body_bytes : options_.request_bytes;
  if (!length.empty() && std::stoull(length) > most)
    return no(413, "at most " + std::to_string(most) + " bytes are taken here");
  return true;
}

void Desk::answer(const Request& request, Response& response, const httplib::ContentReader* body) {
  Call call{request, response, {}, {}};
  const std::string method = request.method == "HEAD" ? "GET" : request.method;
  for (const Route& route : routes())
    if (method == route.method && fits(route.pattern, request.path, call.arguments)) {
      // A scene is held in memory while it arrives: few at a time.
      const bool counted = route.body == Route::Body::scene;
      if (counted && ++uploads_ > options_.uploads) {
        --uploads_;
        return refuse(response, 503, "other scenes are being uploaded; try again shortly");
      }
      const std::shared_ptr<void> leaves(nullptr, [this, counted](void*) { uploads_ -= counted; });
      if (has_body(route, call, body)) route.handler(*this, call);
      return;
    }
}

bool Desk::has_body(const Route& route, Call& call, const httplib::ContentReader* body) {
  if (route.body == Route::Body::none || !call.request.has_header("Content-Length")) return true;
  const std::string type = call.request.get_header_value("Content-Type");
  if (route.body == Route::Body::document && !type.empty() && !type.starts_with(json_type))
    return refuse(call.response, 415, "application/json is expected"), false;
  if (route.body == Route::Body::scene && type != "application/octet-stream")
    return refuse(call.response, 415, "application/octet-stream is expected"), false;
  // Filled as bytes arrive: a mere promise of a gigabyte costs nothing.
  const bool whole = (*body)([&call](const char* bytes, std::size_t size) {
    call.body.append(bytes, size);
    return true;
  });
  if (!whole) refuse(call.response, 400, "the body ended early");
  return whole;
}

// ---- What takes more than a line ---------------------------------------------------------------------------------------

void Desk::events(Call& call) {
  const std::shared_ptr<EventFeed::Seat> seat = feed_.seat();
  if (!seat) return refuse(call.response, 503, "too many are watching; close another dashboard");
  call.response.status = 200;
  call.response.set_chunked_content_provider("text/event-stream", [seat](std::size_t, httplib::DataSink& sink) {
    const std::shared_ptr<const std::string> event = seat->next();
    return event && sink.write(event->data(), event->size());
  });
}

void Desk::submit(Call& call) {
  const std::optional<nlohmann::json> spec = document_in(call.body);
  if (!spec || !spec->is_object()) return refuse(call.response, 400, "a job is one JSON object");
  const auto wrong = [&](const char* why) { refuse(call.response, 400, why); };
  if (!spec->contains("scene") || !(*spec)["scene"].is_string() || !is_digest((*spec)["scene"]))
    return wrong("\"scene\" is the hash of a scene: 64 hexadecimal digits");
  if (spec->contains("title") &&
      (!(*spec)["title"].is_string() || (*spec)["title"].get_ref<const std::string&>().size() > 200))
    return wrong("\"title\" is a text of at most 200 bytes");
  if (spec->contains("options") && !(*spec)["options"].is_object()) return wrong("\"options\" is an object");
  const Expected<std::uint64_t> id = service_.submit(*spec, HttpDoor::caller());
  if (!id) return refuse(call.response, id.error(), false);
  send(call.response, 201, {{"id", *id}});
}

void Desk::add_scene(Call& call) {
  if (call.body.empty()) return refuse(call.response, 400, "a scene has bytes");
  if (!call.arguments.empty() && !is_digest(call.arguments[0]))
    return refuse(call.response, 400, "the path ends with the hash of the scene: 64 hexadecimal digits");
  // Asked before anything is kept, so that nothing is ever found under a wrong name.
  const std::string hash = actors::sha256_of(call.body);
  if (!call.arguments.empty() && call.arguments[0] != hash)
    return refuse(call.response, 400, "these bytes have another hash: they were damaged on the way");
  const Expected<std::string> added = service_.add_scene(call.body);
  if (!added) return refuse(call.response, added.error(), false);
  send(call.response, 201, {{"hash", *added}});
}

void Desk::drain(Call& call) {
  const std::optional<nlohmann::json> wish = call.body.empty() ? nlohmann::json::object() : document_in(call.body);
  if (!wish || !wish->is_object() || (wish->contains("on") && !(*wish)["on"].is_boolean()))
    return refuse(call.response, 400, "{\"on\": true} or {\"on\": false} is expected");
  call.give(service_.drain(call.arguments[0], wish->value("on", true)));
}

void Desk::result(Call& call) {
  const std::string& kind = call.arguments[1];
  const char* type = kind == "image.png"      ? "image/png"
                     : kind == "image.exr"    ? "image/x-exr"
                     : kind == "solution.lht" ? "application/octet-stream"
                                              : nullptr;
  if (!type) return refuse(call.response, 404, "results are image.exr, image.png and solution.lht");
  call.give(service_.result(call.job(), kind), type);
}

}  // namespace lichthof::apps
