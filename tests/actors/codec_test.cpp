// The wire form: what goes in comes out, and nothing that a peer may send does harm.
#include "actors/codec.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "core/base/random.hpp"
#include "core/light/hemicube_bitmap.hpp"
#include "tests/actors/test_system.hpp"
#include "tests/support/toy_light.hpp"

using namespace lichthof;
using actors::decode;
using actors::encode;

namespace {

using Bytes = std::vector<std::uint8_t>;

HemicubeMessage sample_light() {
  const test::ToyWorld world = test::toy_world({2, 1, 1}, 3, 4);
  Shot shot = test::ToyLight(world, CellId{0}).take_shot(GroupId{0}, {CellId{1}, 77'000'000'000}, SceneVersion{5});
  shot.patches.push_back(shot.patches[0]);
  shot.patches[1].columns = 2;
  shot.patches[1].delta.push_back(Rgbf{-1.f, 0.f, 2e-30f});
  shot.patches[1].area.push_back(0.25f);
  HemicubeBitmap bitmap(16);
  bitmap.cover_run(3, 99);
  return {std::make_shared<const Shot>(std::move(shot)), CellId{3}, false, packed(bitmap)};
}

std::vector<Message> samples() {
  CellReport report;
  report.cell = CellId{7}, report.epoch = Epoch{2}, report.wave = 1ull << 40, report.idle = true;
  report.messages_sent = 11, report.messages_processed = 10, report.shots = 9;
  report.strongest_w = 0.125, report.unshot_w = Rgb{1, 2, 3}, report.emitted_w = Rgb{4, 5, 6};
  return {sample_light(),
          HemicubeMessage{sample_light().shot, CellId{1}, true, {}},
          StartRadiosity{Epoch{3}, std::numeric_limits<double>::infinity()},
          CellReady{CellId{4}, -0.0},
          report,
          PollCell{Epoch{1}, 12},
          StopRadiosity{Epoch{9}},
          GeometryChange{SceneVersion{6}, SetEmission{2, Rgb{0.5}}},
          GeometryChange{SceneVersion{7}, SetReflectance{3, Rgb{std::numeric_limits<double>::quiet_NaN()}}},
          JobRequest{WorkerId{8}},
          JobAssignment{{10, 20}, false},
          JobAssignment{{}, true},
          ColumnResult{WorkerId{1}, {4, 6}, {Rgbf{1.f}, Rgbf{INFINITY}, Rgbf{1e-42f}, Rgbf{-0.f}}, {123, 45}, 0.5},
          WorkerLost{WorkerId{6}}};
}

/// Bytes that a decoded message holds in its lists.
std::size_t list_bytes(const Message& message) {
  std::size_t sum = 0;
  if (const auto* light = std::get_if<HemicubeMessage>(&message)) {
    sum += light->bitmap.capacity() + 16 * light->shot->corners.capacity();
    for (const ShotPatch& patch : light->shot->patches)
      sum += sizeof patch + 16 * patch.corners.capacity() + 12 * patch.delta.capacity() + 4 * patch.area.capacity();
  }
  if (const auto* result = std::get_if<ColumnResult>(&message))
    sum += 12 * result->pixels.capacity() + 8 * result->rays.capacity();
  return sum;
}

}  // namespace

TEST_SUITE("codec") {
  TEST_CASE("codec: every message comes out as it went in") {
    std::vector<bool> seen(std::variant_size_v<Message>, false);
    for (const Message& message : samples()) {
      const Bytes bytes = encode(message);
      const Expected<Message> decoded = decode(bytes);
      CAPTURE(message.index());
      REQUIRE(decoded);
      CHECK(decoded->index() == message.index());
      CHECK(encode(*decoded) == bytes);  // bit for bit, infinities and NaN as well
      seen[message.index()] = true;
    }
    for (const bool one : seen) CHECK(one);
  }

  TEST_CASE("codec: fields land where they belong") {
    const Expected<Message> light = decode(encode(sample_light()));
    REQUIRE(light);
    const auto &in = sample_light(), &out = std::get<HemicubeMessage>(*light);
    CHECK(out.from == in.from);
    CHECK(out.bitmap == in.bitmap);
    CHECK(out.shot->id == in.shot->id);
    CHECK(out.shot->version == in.shot->version);
    CHECK(out.shot->plane.normal == in.shot->plane.normal);
    CHECK(out.shot->patches[1].delta == in.shot->patches[1].delta);
    CHECK(out.shot->power() == in.shot->power());
    const Expected<Message> start = decode(encode(StartRadiosity{Epoch{3}, std::numeric_limits<double>::infinity()}));
    REQUIRE(start);
    CHECK(std::isinf(std::get<StartRadiosity>(*start).threshold_w));
  }

  TEST_CASE("codec: the order of the bytes is fixed") {
    const Bytes bytes = encode(CellReady{CellId{0x01020304}, 1.0});
    CHECK(bytes == Bytes{2, 2, 4, 3, 2, 1, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f});
  }

  TEST_CASE("codec: a shot takes the bytes it is counted with") {
    const HemicubeMessage light = sample_light();
    const double counted = static_cast<double>(32 + light.shot->wire_bytes() + light.bitmap.size());
    CHECK(static_cast<double>(encode(light).size()) == doctest::Approx(counted).epsilon(0.08));
  }

  TEST_CASE("codec: no beginning of a message is a message, nor is one with a byte too many") {
    for (const Message& message : samples()) {
      Bytes bytes = encode(message);
      CAPTURE(message.index());
      for (std::size_t length = 0; length < bytes.size(); ++length) REQUIRE(!decode(std::span(bytes).first(length)));
      bytes.push_back(0);
      CHECK(!decode(bytes));
    }
  }

  TEST_CASE("codec: another version and an unknown kind are refused with a reason") {
    Bytes bytes = encode(JobRequest{});
    bytes[0] = 3;
    const Expected<Message> newer = decode(bytes);
    REQUIRE(!newer);
    CHECK(newer.error().message.find("wire form 3") != std::string::npos);
    bytes[0] = 2, bytes[1] = 200;
    CHECK(!decode(bytes));
  }

  TEST_CASE("codec: announced lengths that can not be are refused before anything is allocated") {
    // Every aligned or unaligned place of every message becomes a count of four thousand millions, or of just too many.
    for (const Message& message : samples()) {
      const Bytes sound = encode(message);
      for (std::size_t place = 2; place + 4 <= sound.size(); ++place)
        for (const std::uint32_t count :
             {0xffffffffu, 0x7fffffffu, 0x00ffffffu, static_cast<std::uint32_t>(sound.size())}) {
          Bytes bytes = sound;
          for (int i = 0; i < 4; ++i) bytes[place + i] = static_cast<std::uint8_t>(count >> (8 * i));
          const Expected<Message> decoded = decode(bytes);
          if (decoded) REQUIRE(list_bytes(*decoded) < 8 * bytes.size());
        }
    }
  }

  TEST_CASE("codec: damaged messages never do harm, and what still decodes encodes again") {
    Random random(42);
    std::uint64_t survived = 0;
    for (const Message& message : samples()) {
      const Bytes sound = encode(message);
      for (int round = 0; round < 20'000; ++round) {
        Bytes bytes = sound;
        for (std::uint32_t flips = 1 + random.below(4); flips > 0; --flips)
          bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] ^=
              static_cast<std::uint8_t>(1u << random.below(8));
        if (random.below(8) == 0) bytes.resize(random.below(static_cast<std::uint32_t>(bytes.size())) + 1);
        const Expected<Message> decoded = decode(bytes);
        if (!decoded) continue;
        ++survived;
        REQUIRE(list_bytes(*decoded) < 8 * bytes.size());
        REQUIRE(encode(*decoded) == bytes);
      }
    }
    CHECK(survived > 0);
  }

  TEST_CASE("codec: noise is refused") {
    Random random(7);
    for (int round = 0; round < 50'000; ++round) {
      Bytes bytes(random.below(300));
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.bits());
      if (bytes.size() >= 2 && round % 2) bytes[0] = 1, bytes[1] %= 11;
      const Expected<Message> decoded = decode(bytes);
      if (decoded) REQUIRE(encode(*decoded) == bytes);
    }
  }
}

TEST_SUITE("wire") {
  TEST_CASE_FIXTURE(test::TestSystem, "wire: every message crosses a network as it is") {
    for (const Message& message : samples())
      std::visit(
          [&](auto sent) {
            using M = decltype(sent);
            if constexpr (caf::has_type_id<M>::value) {
              std::vector<char> buffer;
              caf::binary_serializer sink(system, buffer);
              REQUIRE(!sink(sent));
              M received;
              caf::binary_deserializer source(system, buffer);
              REQUIRE(!source(received));
              CHECK(encode(received) == encode(sent));
              for (std::size_t length = 0; length < buffer.size(); length += 7) {
                M other;
                caf::binary_deserializer cut(system, buffer.data(), length);
                REQUIRE(cut(other));
              }
            }
          },
          message);
  }

  TEST_CASE_FIXTURE(test::TestSystem, "wire: whole messages carry their type by name") {
    std::vector<char> buffer;
    caf::binary_serializer sink(system, buffer);
    caf::message sent = caf::make_message(sample_light());
    REQUIRE(!sink(sent));
    caf::message received;
    caf::binary_deserializer source(system, buffer);
    REQUIRE(!source(received));
    REQUIRE(received.match_elements<HemicubeMessage>());
    CHECK(encode(received.get_as<HemicubeMessage>(0)) == encode(sample_light()));
    CHECK(std::string(buffer.begin(), buffer.end()).find("lichthof::HemicubeMessage") != std::string::npos);
  }

  TEST_CASE_FIXTURE(test::TestSystem,
                    "wire: an announced length beyond the bytes that came is refused, as is another message") {
    for (const std::uint32_t length : {0xffffffffu, actors::max_message_bytes, 100u}) {
      std::vector<char> buffer;
      caf::binary_serializer sink(system, buffer);
      std::uint32_t announced = length;
      REQUIRE(!sink(announced));
      JobRequest received;
      caf::binary_deserializer source(system, buffer);
      CHECK(source(received));
    }
    std::vector<char> buffer;
    caf::binary_serializer sink(system, buffer);
    PollCell poll;
    REQUIRE(!sink(poll));
    StopRadiosity stop;
    caf::binary_deserializer source(system, buffer);
    CHECK(source(stop));
  }
}
