#include "io/atomic_file.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;
using lichthof::test::ScratchFolder;

TEST_SUITE("io") {
  TEST_CASE("atomic_file: a file appears whole, and nothing else beside it") {
    const ScratchFolder folder;
    REQUIRE(write_file(folder / "out.txt", "hello"));
    CHECK(folder.read("out.txt") == "hello");
    CHECK(folder.names() == std::vector<std::string>{"out.txt"});
  }

  TEST_CASE("atomic_file: what is not committed leaves the older file alone") {
    const ScratchFolder folder;
    folder.write("out.txt", "old");
    {
      auto file = AtomicFile::create(folder / "out.txt");
      REQUIRE(file);
      REQUIRE(file->append(std::string(3 << 20, 'x')));
    }
    CHECK(folder.read("out.txt") == "old");
    CHECK(folder.names() == std::vector<std::string>{"out.txt"});
  }

  TEST_CASE("atomic_file: an unwritable output is one clear line") {
    const ScratchFolder folder;
    check_error(write_file(folder / "no/such/out.txt", "x"), folder / "no/such/out.txt", "No such file or directory");
    check_error(write_file(folder / "", "x"), folder / "", "directory");
    check_error(writable(folder / "no/out.txt"), folder / "no/out.txt", "No such file or directory");
    CHECK(writable(folder / "out.txt"));
    CHECK(folder.names().empty());
    if (::geteuid() != 0) {
      folder.write("fixed.txt", "old");
      ::chmod((folder / "fixed.txt").c_str(), 0444);
      check_error(write_file(folder / "fixed.txt", "new"), folder / "fixed.txt", "Permission denied");
      CHECK(folder.read("fixed.txt") == "old");
    }
  }

  TEST_CASE("atomic_file: a full disk is one clear line") {
    // /dev/full fails every write with "no space left on device", as a full disk does.
    check_error(write_file("/dev/full", std::string(100, 'x')), "/dev/full", "No space left on device");
    check_error(write_file("/dev/full", std::string(5 << 20, 'x')), "/dev/full", "No space left on device");
  }

  TEST_CASE("atomic_file: devices are written, not replaced") {
    REQUIRE(write_file("/dev/null", "x"));
    CHECK(std::filesystem::is_character_file("/dev/null"));
    CHECK(writable("/dev/null"));
  }

  TEST_CASE("atomic_file: a symbolic link stays one, and its target keeps its mode") {
    const ScratchFolder folder;
    folder.write("real.txt", "old");
    ::chmod((folder / "real.txt").c_str(), 0640);
    std::filesystem::create_symlink("real.txt", folder / "link.txt");
    REQUIRE(write_file(folder / "link.txt", "new"));
    CHECK(std::filesystem::is_symlink(folder / "link.txt"));
    CHECK(folder.read("real.txt") == "new");
    struct stat info {};
    REQUIRE(::stat((folder / "real.txt").c_str(), &info) == 0);
    CHECK((info.st_mode & 0777) == 0640);
  }
}
