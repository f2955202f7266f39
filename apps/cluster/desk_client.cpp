#include "apps/cluster/desk_client.hpp"

#include <algorithm>
#include <charconv>
#include <limits>

#include "actors/link/socket.hpp"
#include "apps/cluster/desk.hpp"
#include "apps/cluster/desk_stream.hpp"

namespace lichthof::apps {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds connect_time{5000}, patience{60000}, whole_answer{86400000};
constexpr std::size_t most_text_bytes = 64u << 20;
constexpr std::size_t longest_complaint = 400;

/// The library's client over our stream, so that certificates mean here what they mean everywhere in the lab: a controller
/// is who has a controller's certificate, whatever its machine is called.
class Connection final : public httplib::ClientImpl {
 public:
  explicit Connection(const DeskAddress& address) : ClientImpl(address.host, address.port), address_(address) {
    set_connection_timeout(connect_time);
    set_keep_alive(false);
    set_decompress(true);
  }
  /// What the library does not know about a failure; empty: nothing.
  const std::string& failure() const { return failure_; }

 private:
  bool process_socket(const Socket& socket, std::function<bool(httplib::Stream&)> exchange) override {
    DeskStream stream(socket.sock, address_.tls, true, patience);
    const bool known = stream.shake_hands();
    if (known && stream.peer() && stream.peer()->role != actors::Role::controller)
      failure_ = "this is " + actors::name_of(stream.peer()->role) + " " + stream.peer()->name + ", no controller";
    stream.allow(std::numeric_limits<std::size_t>::max(), whole_answer);
    const bool done = known && failure_.empty() && exchange(stream);
    if (failure_.empty()) failure_ = stream.failure();
    return done;
  }

  DeskAddress address_;
  std::string failure_;
};

std::string endpoint_of(const DeskAddress& address) { return actors::endpoint(address.host, address.port); }

Error unreachable(const DeskAddress& address, const Connection& connection, httplib::Error error) {
  const bool nobody = error == httplib::Error::Connection || error == httplib::Error::ConnectionTimeout;
  std::string why = connection.failure();
  if (nobody) why = "no controller answers; start one, or name another with --cluster";
  if (why.empty()) why = "the connection broke before the answer was complete";
  if (address.tls == nullptr && !nobody) why += "; if the controller speaks TLS, certificates are needed";
  return {ErrorCode::failed, endpoint_of(address), why};
}

/// The desk's own words, on one printable line.
Error refusal(const DeskAddress& address, int status, const std::string& body) {
  const nlohmann::json document = nlohmann::json::parse(body.substr(0, 65536), nullptr, false);
  std::string why = "HTTP status " + std::to_string(status);
  if (document.is_object() && document.contains("error") && document["error"].is_string()) why = document["error"];
  for (char& c : why)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  const bool asked_wrongly = status == 400 || status == 404;
  return {asked_wrongly ? ErrorCode::bad_input : ErrorCode::failed, endpoint_of(address),
          why.substr(0, longest_complaint)};
}

/// Collects an answer of bounded length.
httplib::ContentReceiver into(std::string& text) {
  return [&text](const char* bytes, std::size_t size) {
    if (text.size() + size > most_text_bytes) return false;
    text.append(bytes, size);
    return true;
  };
}

Expected<nlohmann::json> document_in(const DeskAddress& address, const std::string& text) {
  nlohmann::json document = nlohmann::json::parse(text, nullptr, false);
  if (document.is_discarded())
    return Error{ErrorCode::failed, endpoint_of(address), "answers no JSON: is this a controller?"};
  return document;
}

}  // namespace

Expected<DeskAddress> desk_address(const std::string& text, const std::string& where) {
  const Error wrong{ErrorCode::bad_input, where, "HOST or HOST:PORT was expected, for example lab7:7410"};
  DeskAddress address;
  address.port = default_desk_port;
  std::string host = text, port;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string::npos) return wrong;
    host = text.substr(1, end - 1), port = text.substr(end + 1);
  } else if (const std::size_t colon = text.find(':'); colon != std::string::npos && colon == text.rfind(':')) {
    host = text.substr(0, colon), port = text.substr(colon);
  }
  if (host.empty() || host.size() > 253 || host.find_first_of(" /\t\r\n@") != std::string::npos) return wrong;
  if (!port.empty()) {
    const auto [end, problem] = std::from_chars(port.data() + 1, port.data() + port.size(), address.port);
    if (port[0] != ':' || problem != std::errc() || end != port.data() + port.size() || address.port == 0) return wrong;
  }
  address.host = host;
  return address;
}

Expected<std::string> DeskClient::text(const std::string& path) const {
  Connection connection(address_);
  std::string body;
  const httplib::Result result = connection.Get(path, into(body));
  if (!result) return unreachable(address_, connection, result.error());
  if (result->status != 200) return refusal(address_, result->status, body);
  return body;
}

Expected<nlohmann::json> DeskClient::get(const std::string& path) const {
  const Expected<std::string> body = text(path);
  if (!body) return body.error();
  return document_in(address_, *body);
}

Expected<nlohmann::json> DeskClient::post(const std::string& path, const nlohmann::json& body) const {
  Connection connection(address_);
  const httplib::Result result = connection.Post(path, text_of(body), "application/json");
  if (!result) return unreachable(address_, connection, result.error());
  if (result->status != 200 && result->status != 201) return refusal(address_, result->status, result->body);
  return document_in(address_, result->body);
}

Status DeskClient::download(const std::string& path, const std::function<bool(std::string_view)>& take) const {
  Connection connection(address_);
  int status = 0;
  std::string complaint;
  const httplib::Result result = connection.Get(
      path, [&status](const httplib::Response& response) { return status = response.status, true; },
      [&](const char* bytes, std::size_t size) {
        return status == 200 ? take({bytes, size}) : into(complaint)(bytes, size);
      });
  if (!result) return unreachable(address_, connection, result.error());
  if (result->status != 200) return refusal(address_, result->status, complaint);
  return Done{};
}

Expected<bool> DeskClient::has_scene(const std::string& hash) const {
  Connection connection(address_);
  const httplib::Result result = connection.Head("/v1/scenes/" + hash);
  if (!result) return unreachable(address_, connection, result.error());
  if (result->status == 404) return false;
  if (result->status != 200) return refusal(address_, result->status, "");
  return true;
}

Status DeskClient::upload_scene(const std::string& hash, const std::string& bytes,
                                const std::function<bool(double)>& sent) const {
  Connection connection(address_);
  bool given_up = false;
  const httplib::Result result = connection.Put(
      "/v1/scenes/" + hash, bytes.size(),
      [&](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        given_up = !sent(static_cast<double>(offset) / static_cast<double>(bytes.size()));
        constexpr std::size_t piece = 1u << 20;
        return !given_up && sink.write(bytes.data() + offset, std::min(length, piece));
      },
      "application/octet-stream");
  if (given_up) return Error{ErrorCode::interrupted, "", "interrupted while the scene was being sent"};
  if (!result) return unreachable(address_, connection, result.error());
  if (result->status != 201) return refusal(address_, result->status, result->body);
  return Done{};
}

}  // namespace lichthof::apps
