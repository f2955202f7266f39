#include "actors/cluster/kept_columns.hpp"

#include <doctest/doctest.h>

#include <filesystem>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::actors;

namespace {

constexpr std::uint32_t columns = 6, height = 3;

std::vector<Rgbf> pixels(float value) { return {Rgbf{value}, Rgbf{value + 1}, Rgbf{-0.f, 1e-42f, INFINITY}}; }

KeptColumns opened(const std::string& path, const std::string& key = "a picture") {
  Expected<KeptColumns> kept = KeptColumns::open(path, key, columns, height);
  REQUIRE(kept);
  return std::move(*kept);
}

}  // namespace

TEST_SUITE("kept_columns") {
  TEST_CASE("kept_columns: what was added is there again, bit for bit") {
    const test::ScratchFolder folder;
    KeptColumns first = opened(folder / "c");
    CHECK(first.take().empty());
    REQUIRE(first.add(4, pixels(7), 123));
    REQUIRE(first.add(0, pixels(9), 5));
    CHECK(first.has(4));
    CHECK(!first.has(1));
    KeptColumns second = opened(folder / "c");
    const std::vector<ColumnResult> found = second.take();
    REQUIRE(found.size() == 2);
    CHECK(found[0].job.first == 4);
    CHECK(found[0].job.last == 5);
    CHECK(found[0].rays == std::vector<std::uint64_t>{123});
    CHECK(found[0].pixels == pixels(7));
    CHECK(found[1].pixels == pixels(9));
    CHECK(second.has(0));
  }

  TEST_CASE("kept_columns: a torn or damaged record ends it, and what follows is written in its place") {
    const test::ScratchFolder folder;
    {
      KeptColumns kept = opened(folder / "c");
      for (std::uint32_t column = 0; column < 4; ++column) REQUIRE(kept.add(column, pixels(1), 1));
    }
    std::filesystem::resize_file(folder / "c", std::filesystem::file_size(folder / "c") - 3);
    {
      KeptColumns kept = opened(folder / "c");
      CHECK(kept.take().size() == 3);
      REQUIRE(kept.add(5, pixels(2), 1));
    }
    CHECK(opened(folder / "c").take().size() == 4);
    std::string bytes = folder.read("c");
    bytes[bytes.size() - 20] = static_cast<char>(bytes[bytes.size() - 20] ^ 1);
    std::ofstream(folder / "c", std::ios::binary) << bytes;
    CHECK(opened(folder / "c").take().size() == 3);
  }

  TEST_CASE("kept_columns: columns of another picture, and files of others, count for nothing") {
    const test::ScratchFolder folder;
    REQUIRE(opened(folder / "c").add(1, pixels(1), 1));
    CHECK(opened(folder / "c", "another").take().empty());
    CHECK(opened(folder / "c").take().empty());
    std::ofstream(folder / "c", std::ios::binary) << "something else";
    CHECK(opened(folder / "c").take().empty());
  }

  TEST_CASE("kept_columns: where nothing can be written it says so") {
    const test::ScratchFolder folder;
    CHECK(!KeptColumns::open(folder / "none/c", "a", columns, height));
  }
}
