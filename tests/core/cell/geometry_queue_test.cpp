#include "core/cell/geometry_queue.hpp"

#include <doctest/doctest.h>

using namespace lichthof;

namespace {
GeometryChange change(std::uint64_t version) {
  return {SceneVersion{version}, SetEmission{static_cast<std::uint32_t>(version), Rgb{1.0}}};
}
}  // namespace

TEST_SUITE("geometry_queue") {
  TEST_CASE(
      "geometry_queue: changes leave in order of version whatever the order of arrival, and stay in the history") {
    GeometryQueue queue;
    CHECK(queue.file(change(3)));
    CHECK(!queue.has_next());
    CHECK(queue.file(change(1)));
    REQUIRE(queue.has_next());
    CHECK(queue.take_next().version == SceneVersion{1});
    CHECK(!queue.has_next());
    CHECK(queue.file(change(2)));
    CHECK(queue.take_next().version == SceneVersion{2});
    CHECK(queue.take_next().version == SceneVersion{3});
    CHECK(queue.version() == SceneVersion{3});
    REQUIRE(queue.history().size() == 3);
    CHECK(std::get<SetEmission>(queue.history()[1].change).material == 2);
  }

  TEST_CASE("geometry_queue: known versions, version 0 and absurd ones are refused") {
    GeometryQueue queue;
    CHECK(!queue.file(change(0)));
    CHECK(queue.file(change(1)));
    CHECK(!queue.file(change(1)));
    queue.take_next();
    CHECK(!queue.file(change(1)));
    CHECK(!queue.file(change(1ull << 60)));
    CHECK(queue.waiting() == 0);
  }
}
