/// The desk over real sockets: every path and role, and everything a stranger might try.
#include "apps/cluster/desk.hpp"

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "actors/link/digest.hpp"
#include "actors/link/keys.hpp"
#include "apps/cluster/desk_client.hpp"
#include "tests/support/scratch_folder.hpp"
#include "tests/support/toy_lab.hpp"

using namespace lichthof;
using namespace lichthof::apps;
using lichthof::testing::ToyLab;
using namespace std::chrono_literals;

namespace {

/// A plain socket to a desk; everything waits at most ten seconds.
class Visitor {
 public:
  explicit Visitor(std::uint16_t port, int receive_bytes = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit = {10, 0};
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    if (receive_bytes > 0) ::setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(socket_.fd(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  }
  void say(const std::string& text) { (void)!::send(socket_.fd(), text.data(), text.size(), MSG_NOSIGNAL); }
  /// Reads until `part` has come, or the end.
  std::string hear(const std::string& part = "") {
    char bytes[4096];
    while (part.empty() || heard_.find(part) == std::string::npos) {
      const ssize_t count = ::recv(socket_.fd(), bytes, sizeof bytes, 0);
      if (count <= 0) break;
      heard_.append(bytes, static_cast<std::size_t>(count));
    }
    return heard_;
  }

 private:
  actors::Socket socket_;
  std::string heard_;
};

struct Reply {
  int status = 0;
  std::string head, body;
  nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
  /// The one line of an error.
  std::string error() const {
    const nlohmann::json document = json();
    return document.is_object() ? document.value("error", "") : "";
  }
};

Reply reply_in(const std::string& text) {
  Reply reply;
  const std::size_t end = text.find("\r\n\r\n");
  if (end == std::string::npos) return reply;
  reply.head = text.substr(0, end), reply.body = text.substr(end + 4);
  if (reply.head.starts_with("HTTP/1.1 ")) reply.status = std::stoi(reply.head.substr(9, 3));
  return reply;
}

/// A desk on loopback in the clear.
struct House {
  explicit House(DeskOptions options = {}) {
    options.port = 0;
    options.event_period = 20ms;
    auto opened = Desk::open(std::move(options), lab);
    REQUIRE(opened);
    desk = std::move(*opened);
  }
  Reply said(const std::string& text) {
    Visitor caller(desk->port());
    caller.say(text);
    return reply_in(caller.hear());
  }
  Reply asked(const std::string& method, const std::string& path, const std::string& body = "",
              const std::string& fields = "Host: localhost\r\nContent-Type: application/json\r\n") {
    return said(method + " " + path + " HTTP/1.1\r\n" + fields +
                (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" + body);
  }
  Reply asked_with(const std::string& fields) { return asked("GET", "/v1/nodes", "", fields); }

  ToyLab lab;
  std::unique_ptr<Desk> desk;
};

const std::string octets = "Host: localhost\r\nContent-Type: application/octet-stream\r\n";

}  // namespace

TEST_SUITE("desk") {
  TEST_CASE("desk: every path answers a viewer") {
    House house;
    const std::uint64_t job = house.lab.add_job("done");
    CHECK(house.asked("GET", "/v1/nodes").json().size() == 2);
    CHECK(house.asked("GET", "/v1/actors").json().size() == 2);
    CHECK(house.asked("GET", "/v1/jobs").json().size() == 1);
    CHECK(house.asked("GET", "/v1/methods").json()[0]["name"] == "two-pass");
    CHECK(house.asked("GET", "/v1/jobs/1").json()["id"] == job);
    CHECK(house.asked("GET", "/v1/jobs/1/log").body.starts_with("it began"));
    CHECK(house.asked("GET", "/v1/jobs/1/picture.png").head.find("Content-Type: image/png") != std::string::npos);
    CHECK(house.asked("GET", "/v1/jobs/1/result/image.exr").body == "image.exr");
    CHECK(house.asked("GET", "/v1/jobs/1/result/solution.lht").body == "solution.lht");
    CHECK(house.asked("GET", "/metrics").body.find("lichthof_nodes 2") != std::string::npos);
    const Reply page = house.asked("GET", "/");
    CHECK(page.body.starts_with("<!doctype html>"));
    CHECK(page.head.find("Content-Security-Policy: default-src 'none'") != std::string::npos);
    CHECK(page.head.find("X-Frame-Options: DENY") != std::string::npos);
    const Reply head = house.asked("HEAD", "/v1/nodes");
    CHECK(head.status == 200);
    CHECK(head.body.empty());
  }

  TEST_CASE("desk: what is not there has its status and one line of error") {
    House house;
    house.lab.add_job("running");
    for (const char* path :
         {"/v1", "/v2/nodes", "/v1/nodes/", "//", "/v1/jobs/", "/../etc/passwd", "/v1/jobs/1/result"}) {
      INFO(path);
      CHECK(house.asked("GET", path).status == 404);
      CHECK_FALSE(house.asked("GET", path).error().empty());
    }
    for (const char* id : {"2", "0", "-1", "x", "1x", "99999999999999999999999", "%00", "1%2Flog"}) {
      INFO(id);
      CHECK(house.asked("GET", std::string("/v1/jobs/") + id + (id[0] == '1' && id[1] == '%' ? "/x" : "")).status ==
            404);
    }
    CHECK(house.asked("GET", "/v1/jobs/1/result/image.exr").status == 409);
    CHECK(house.asked("GET", "/v1/jobs/1/result/../../x").status == 404);
    CHECK(house.asked("GET", "/v1/jobs/1/result/image.gif").status == 404);
    CHECK(house.asked("DELETE", "/v1/jobs/1").status == 405);
    CHECK(house.asked("POST", "/v1/nodes").status == 405);
    CHECK(house.asked("OPTIONS", "/v1/nodes").status == 405);
    CHECK(house.asked("GET", "/v1/jobs/1/cancel").status == 405);
    CHECK(house.asked("POST", "/v1/jobs/7/cancel").status == 404);
    CHECK(house.asked("POST", "/v1/nodes/lab9/kick").status == 404);
  }

  TEST_CASE("desk: a user hands in scenes and jobs and leads both") {
    House house;
    const std::string bytes(100000, 's'), hash = actors::sha256_of(bytes);
    CHECK(house.asked("HEAD", "/v1/scenes/" + hash).status == 404);
    CHECK(house.asked("PUT", "/v1/scenes/" + hash, bytes, octets).status == 201);
    CHECK(house.asked("HEAD", "/v1/scenes/" + hash).status == 200);
    CHECK(house.lab.scenes[hash] == bytes);
    CHECK(house.asked("POST", "/v1/scenes", "other", octets).json()["hash"] == actors::sha256_of("other"));
    CHECK(house.asked("PUT", "/v1/scenes/" + hash, "other bytes", octets).status == 400);
    CHECK(house.asked("PUT", "/v1/scenes/short", "x", octets).status == 400);
    CHECK(house.asked("PUT", "/v1/scenes/" + hash, "", octets).status == 400);
    CHECK(house.asked("POST", "/v1/scenes", "damaged", octets).status == 400);
    CHECK(house.asked("POST", "/v1/scenes", "{}").status == 415);

    house.lab.start_state = "running";
    const nlohmann::json spec = {{"scene", hash}, {"title", "a room"}, {"options", {{"width", 64}}}};
    const Reply made = house.asked("POST", "/v1/jobs", spec.dump());
    CHECK(made.status == 201);
    CHECK(made.json()["id"] == 1);
    CHECK(house.lab.last_spec == spec);
    CHECK(house.asked("GET", "/v1/jobs/1").json()["owner"] == "local");
    CHECK(house.asked("POST", "/v1/jobs/1/cancel").status == 200);
    CHECK(house.lab.state(1) == "cancelled");
    CHECK(house.asked("POST", "/v1/jobs/1/resume", "{}").status == 200);
    CHECK(house.lab.state(1) == "running");
    CHECK(house.asked("POST", "/v1/nodes/lab1/drain").status == 200);
    CHECK(house.lab.drained.count("lab1") == 1);
    CHECK(house.asked("POST", "/v1/nodes/lab1/drain", "{\"on\": false}").status == 200);
    CHECK(house.lab.drained.empty());
    CHECK(house.asked("POST", "/v1/nodes/lab1/drain", "{\"on\": 3}").status == 400);
    CHECK(house.asked("POST", "/v1/nodes/lab2/kick").status == 200);
  }

  TEST_CASE("desk: a job that makes no sense is refused") {
    House house;
    const std::string hash(64, 'a');
    for (const std::string& body :
         {std::string("{"), std::string("[]"), std::string("3"), std::string("{}"), std::string(R"({"scene": 3})"),
          R"({"scene": ")" + hash + R"(", "title": 3})", R"({"scene": ")" + hash + R"(", "options": []})",
          R"({"scene": ")" + hash + R"("})", std::string(R"({"scene": "../../etc/passwd"})"),
          "{\"scene\": \"" + hash + "\", \"title\": \"" + std::string(201, 't') + "\"}", std::string(900000, '['),
          std::string("\xff\xfe")}) {
      const Reply reply = house.asked("POST", "/v1/jobs", body);
      INFO(body.substr(0, 80));
      CHECK(reply.status == 400);
      CHECK_FALSE(reply.error().empty());
    }
    CHECK(house.asked("POST", "/v1/jobs").status == 400);
    CHECK(house.asked("POST", "/v1/jobs", "a=b", "Host: localhost\r\nContent-Type: text/plain\r\n").status == 415);
    CHECK(house.asked("POST", "/v1/jobs", "{}", octets).status == 415);
  }

  TEST_CASE("desk: other sites and borrowed names are refused") {
    House house;
    const std::string port = std::to_string(house.desk->port());
    for (const std::string& host : {std::string("localhost"), "localhost:" + port, "127.0.0.1:" + port,
                                    std::string("[::1]:80"), std::string("LOCALHOST")})
      CHECK(house.asked_with("Host: " + host + "\r\n").status == 200);
    for (const char* host : {"evil.example", "evil.example:7410", "localhost.evil.example", "", "localhost:80:80",
                             "localhost@evil.example", "[::1", "127.0.0.1.evil.example"}) {
      INFO(host);
      CHECK(house.asked_with(std::string("Host: ") + host + "\r\n").status == 403);
    }
    CHECK(house.asked_with("").status == 403);
    CHECK(house.asked_with("Host: localhost\r\nHost: evil.example\r\n").status == 403);
    const std::string host = "Host: localhost:" + port + "\r\n";
    CHECK(house.asked_with(host + "Origin: http://localhost:" + port + "\r\n").status == 200);
    for (const char* origin :
         {"http://evil.example", "null", "https://localhost", "http://localhost:1", "http://localhost"}) {
      INFO(origin);
      CHECK(house.asked_with(host + "Origin: " + origin + "\r\n").status == 403);
    }
    CHECK(house.asked_with(host + "Sec-Fetch-Site: cross-site\r\n").status == 403);
    CHECK(house.asked_with(host + "Sec-Fetch-Site: same-origin\r\n").status == 200);
    CHECK(house.asked("POST", "/v1/nodes/lab1/kick", "", host + "Origin: http://evil.example\r\n").status == 403);
    CHECK(house.lab.drained.empty());
  }

  TEST_CASE("desk: malformed and oversized requests end with a status, and the desk lives on") {
    House house;
    const std::string host = "Host: localhost\r\n";
    CHECK(house.said("nonsense\r\n\r\n").status == 400);
    CHECK(house.said("GET /v1/nodes HTTP/9.9\r\n" + host + "\r\n").status == 400);
    CHECK(house.said("GET /" + std::string(600, 'a') + " HTTP/1.1\r\n" + host + "\r\n").status == 414);
    CHECK(house.said("GET /" + std::string(9000, 'a') + " HTTP/1.1\r\n" + host + "\r\n").status == 414);
    const int long_field =
        house.said("GET / HTTP/1.1\r\n" + host + "X: " + std::string(20000, 'x') + "\r\n\r\n").status;
    CHECK(long_field == 400);
    std::string many = "GET / HTTP/1.1\r\n" + host;
    for (int i = 0; i < 20000; ++i) many += "X" + std::to_string(i) + ": y\r\n";
    CHECK(house.said(many + "\r\n").status == 400);
    const auto post = [&](const std::string& fields, const std::string& body = "") {
      return house.said("POST /v1/jobs HTTP/1.1\r\n" + host + "Content-Type: application/json\r\n" + fields + "\r\n" +
                        body);
    };
    CHECK(post("Content-Length: 1048577\r\n").status == 413);
    CHECK(post("Content-Length: -1\r\n").status == 400);
    CHECK(post("Content-Length: 12x\r\n").status == 400);
    CHECK(post("Content-Length: 2\r\nContent-Length: 3\r\n", "{}").status == 400);
    CHECK(post("Content-Length: 99999999999999999999999999\r\n").status == 400);
    CHECK(post("Transfer-Encoding: chunked\r\n", "2\r\n{}\r\n0\r\n\r\n").status == 411);
    CHECK(post("Content-Encoding: gzip\r\nContent-Length: 2\r\n", "{}").status == 415);
    CHECK(post("Expect: 100-continue\r\nContent-Length: 9999999\r\n").status == 413);
    CHECK(house
              .said("PUT /v1/scenes/" + std::string(64, 'a') + " HTTP/1.1\r\n" + octets +
                    "Content-Length: 2000000000\r\n\r\n")
              .status == 413);
    CHECK(house.said("GET /v1/nodes HTTP/1.1\r\n" + host + "Content-Length: 3\r\n\r\nabc").status == 400);
    CHECK(house.said("GET /v1/nodes HTTP/1.1\r\n" + host + "Range: bytes=0-1,0-1,0-1\r\n\r\n").json().size() == 2);
    // What follows a refused body is no second request.
    const Reply smuggled = post("Transfer-Encoding: chunked\r\n", "GET /v1/nodes HTTP/1.1\r\n" + host + "\r\n");
    CHECK(smuggled.status == 411);
    CHECK(smuggled.body.find("HTTP/1.1") == std::string::npos);
    CHECK(house.asked("GET", "/v1/nodes").status == 200);
  }

  TEST_CASE("desk: whoever is slow or silent is let go") {
    DeskOptions options;
    options.door.head_time = 300ms;
    options.door.patience = 300ms;
    House house(options);
    const auto start = std::chrono::steady_clock::now();
    Visitor silent(house.desk->port()), half(house.desk->port()), promised(house.desk->port());
    half.say("GET /v1/nodes HT");
    promised.say(
        "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 500\r\n\r\n{");
    silent.hear(), half.hear();
    CHECK(reply_in(promised.hear()).status == 400);
    CHECK(std::chrono::steady_clock::now() - start < 5s);
    // A byte now and then does not help.
    Visitor dripping(house.desk->port());
    for (int i = 0; i < 10; ++i) dripping.say("G"), std::this_thread::sleep_for(60ms);
    dripping.hear();
    CHECK(std::chrono::steady_clock::now() - start < 8s);
    CHECK(house.asked("GET", "/v1/nodes").status == 200);
  }

  TEST_CASE("desk: connections and uploads beyond the limit are turned away") {
    DeskOptions options;
    options.door.connections = 4;
    options.uploads = 1;
    House house(options);
    {
      std::vector<std::unique_ptr<Visitor>> guests;
      for (int i = 0; i < 4; ++i) guests.push_back(std::make_unique<Visitor>(house.desk->port()));
      std::this_thread::sleep_for(300ms);
      const Reply refused = house.asked("GET", "/v1/nodes");
      CHECK(refused.status == 503);
      CHECK_FALSE(refused.error().empty());
    }
    std::this_thread::sleep_for(300ms);
    Visitor slow(house.desk->port());
    slow.say("POST /v1/scenes HTTP/1.1\r\n" + octets + "Content-Length: 10\r\n\r\n12345");
    std::this_thread::sleep_for(200ms);
    CHECK(house.asked("POST", "/v1/scenes", "xx", octets).status == 503);
    slow.say("67890");
    CHECK(reply_in(slow.hear()).status == 201);
    CHECK(house.asked("POST", "/v1/scenes", "xx", octets).status == 201);
  }

  TEST_CASE("desk: whoever is inside and silent makes room for others") {
    DeskOptions options;
    options.door.connections = 4;
    options.door.idle_time = 200ms;
    House house(options);
    std::vector<std::unique_ptr<Visitor>> guests;
    for (int i = 0; i < 4; ++i) guests.push_back(std::make_unique<Visitor>(house.desk->port()));
    Reply reply;
    for (int i = 0; i < 100 && reply.status != 200; ++i) {
      std::this_thread::sleep_for(50ms);
      reply = house.asked("GET", "/v1/nodes");
    }
    CHECK(reply.status == 200);
    CHECK(guests[0]->hear().empty());  // the oldest had to go
  }

  TEST_CASE("desk: events come each period, a stalled viewer is dropped, others see the latest state") {
    DeskOptions options;
    options.event_streams = 2;
    options.door.patience = 3s;  // on a busy machine the third asks late
    House house(options);
    house.lab.padding = 100000;
    const std::string ask = "GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
    Visitor stalled(house.desk->port(), 4096), lively(house.desk->port());
    stalled.say(ask), lively.say(ask);
    const std::string first = lively.hear("\n\n");
    CHECK(first.find("text/event-stream") != std::string::npos);
    CHECK(first.find("data: {") != std::string::npos);
    Visitor third(house.desk->port());
    third.say(ask);
    CHECK(reply_in(third.hear("\r\n\r\n")).status == 503);
    house.lab.padding = 0;
    house.lab.add_job("running");
    CHECK(lively.hear("a room").find("a room") != std::string::npos);
    house.lab.padding = 1000000;
    // The stalled one takes nothing: its seat becomes free although its socket is open.
    Reply next;
    for (int i = 0; i < 400 && next.status != 200; ++i) {
      std::this_thread::sleep_for(50ms);
      Visitor late(house.desk->port());
      late.say(ask);
      next = reply_in(late.hear("\r\n\r\n"));
    }
    CHECK(next.status == 200);
  }

  TEST_CASE("desk: it closes at once, whoever is inside") {
    auto house = std::make_unique<House>();
    Visitor watching(house->desk->port()), silent(house->desk->port());
    watching.say("GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    watching.hear("data: ");
    const auto start = std::chrono::steady_clock::now();
    house->desk.reset();
    CHECK(std::chrono::steady_clock::now() - start < 2s);
  }

  TEST_CASE("desk: beyond loopback it opens only with certificates, or when told that it is insecure") {
    ToyLab lab;
    DeskOptions options;
    options.host = "0.0.0.0";
    options.port = 0;
    const auto refused = Desk::open(options, lab);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::bad_input);
    CHECK(refused.error().message.find("--insecure") != std::string::npos);
    options.insecure = true;
    CHECK(Desk::open(options, lab));
    DeskOptions taken;
    taken.port = 0;
    const auto first = Desk::open(taken, lab);
    REQUIRE(first);
    taken.port = (*first)->port();
    CHECK_FALSE(Desk::open(taken, lab));
  }
}

// ---- TLS --------------------------------------------------------------------------------------------------------------

namespace {

/// A lab with an authority, and a desk that asks for its certificates.
struct SecureHouse {
  SecureHouse() {
    REQUIRE(actors::create_authority(keys));
    DeskOptions options;
    options.port = 0;
    options.tls = context("controller", actors::Role::controller);
    auto opened = Desk::open(options, lab);
    REQUIRE(opened);
    desk = std::move(*opened);
  }
  std::shared_ptr<const actors::TlsContext> context(const std::string& name, actors::Role role) {
    REQUIRE(actors::issue_certificate(keys, {name, role}));
    const auto loaded =
        actors::TlsContext::load({keys + "/ca.crt", keys + "/" + name + ".crt", keys + "/" + name + ".key"});
    REQUIRE(loaded);
    return *loaded;
  }
  DeskClient client(std::shared_ptr<const actors::TlsContext> tls) const {
    return DeskClient({"127.0.0.1", desk->port(), std::move(tls)});
  }
  lichthof::test::ScratchFolder folder;
  std::string keys = folder / "keys";
  ToyLab lab;
  std::unique_ptr<Desk> desk;
};

bool fails(const Expected<nlohmann::json>& answer, const std::string& part) {
  if (answer) return false;
  INFO(answer.error().text());
  CHECK(answer.error().text().find(part) != std::string::npos);
  return true;
}

}  // namespace

TEST_SUITE("desk") {
  TEST_CASE("desk over TLS: the certificate says who may do what") {
    SecureHouse house;
    house.lab.start_state = "running";
    const DeskClient user = house.client(house.context("anna", actors::Role::user));
    const DeskClient viewer = house.client(house.context("guest", actors::Role::viewer));
    const DeskClient node = house.client(house.context("lab1", actors::Role::node));
    REQUIRE(user.get("/v1/nodes"));
    REQUIRE(viewer.get("/v1/nodes"));
    CHECK(fails(node.get("/v1/nodes"), "a node's certificate"));
    const std::string scene(3000000, 's'), hash = actors::sha256_of(scene);
    REQUIRE(user.upload_scene(hash, scene, [](double) { return true; }));
    CHECK(*user.has_scene(hash));
    CHECK(*viewer.has_scene(hash));
    const auto id = user.post("/v1/jobs", {{"scene", hash}});
    REQUIRE(id);
    CHECK((*user.get("/v1/jobs/1"))["owner"] == "anna");
    CHECK(fails(viewer.post("/v1/jobs", {{"scene", hash}}), "a viewer may look"));
    CHECK(fails(viewer.post("/v1/jobs/1/cancel"), "a viewer may look"));
    CHECK_FALSE(viewer.upload_scene(hash, scene, [](double) { return true; }));
    CHECK(house.lab.uploads == 1);
    CHECK(user.post("/v1/jobs/1/cancel"));
    REQUIRE(house.lab.move(1, "done"));
    house.lab.result_padding = 5000000;
    std::size_t bytes = 0;
    CHECK(viewer.download("/v1/jobs/1/result/image.png",
                          [&](std::string_view piece) { return bytes += piece.size(), true; }));
    CHECK(bytes == 5000009);
  }

  TEST_CASE("desk over TLS: no certificate, a foreign one, or no TLS at all opens nothing") {
    SecureHouse house, foreign;
    CHECK(fails(house.client(nullptr).get("/v1/nodes"), "certificates are needed"));
    CHECK(fails(house.client(foreign.context("anna", actors::Role::user)).get("/v1/nodes"), "certificate"));
    Visitor plain(house.desk->port());
    plain.say("GET /v1/nodes HTTP/1.1\r\nHost: localhost\r\n\r\n");
    CHECK(plain.hear().find("lab1") == std::string::npos);
    // And the client speaks with nobody but a controller of its own lab.
    DeskOptions options;
    options.port = 0;
    options.tls = house.context("lab7", actors::Role::node);
    const auto impostor = Desk::open(options, house.lab);
    REQUIRE(impostor);
    const DeskClient client({"127.0.0.1", (*impostor)->port(), house.context("anna", actors::Role::user)});
    CHECK(fails(client.get("/v1/nodes"), "this is node lab7, no controller"));
  }

  TEST_CASE("desk over TLS: who is revoked sees no more, not even what he was watching") {
    SecureHouse house;
    const DeskClient viewer = house.client(house.context("guest", actors::Role::viewer));
    const DeskClient user = house.client(house.context("anna", actors::Role::user));
    std::atomic<int> events{0};
    std::atomic<bool> ended{false};
    std::thread watching([&] {
      (void)viewer.download("/v1/events", [&](std::string_view) { return ++events, true; });
      ended = true;
    });
    const auto until = [](auto condition) {
      for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(20ms);
      return condition();
    };
    CHECK(until([&] { return events > 0; }));
    REQUIRE(actors::revoke_certificate(house.keys, "guest"));
    CHECK(until([&] { return ended.load(); }));
    if (!ended) house.desk.reset();
    watching.join();
    REQUIRE(house.desk);
    CHECK(fails(viewer.get("/v1/nodes"), "revoked"));
    CHECK(user.get("/v1/nodes"));
  }

  TEST_CASE("digest: SHA-256 of \"abc\" as the standard gives it") {
    CHECK(actors::sha256_of("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(actors::sha256_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  }

  TEST_CASE("desk client: an address is a host and perhaps a port") {
    const auto good = [](const std::string& text, const std::string& host, int port) {
      const auto address = desk_address(text, "--cluster");
      INFO(text);
      REQUIRE(address);
      CHECK(address->host == host);
      CHECK(address->port == port);
    };
    good("lab7", "lab7", default_desk_port);
    good("lab7:80", "lab7", 80);
    good("[::1]:80", "::1", 80);
    good("[::1]", "::1", default_desk_port);
    good("::1", "::1", default_desk_port);
    for (const char* text : {"", ":80", "lab7:", "lab7:0", "lab7:65536", "lab7:x", "[::1", "a b:3", "user@lab7:80"}) {
      INFO(text);
      CHECK_FALSE(desk_address(text, "--cluster"));
    }
  }
}
