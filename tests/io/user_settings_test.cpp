#include "io/user_settings.hpp"

#include <doctest/doctest.h>

#include "tests/support/scratch_folder.hpp"

using namespace lichthof;
using namespace lichthof::io;
using lichthof::test::check_error;

TEST_SUITE("io") {
  TEST_CASE("user_settings: what is written is read, names of files are relative to the file's folder") {
    const test::ScratchFolder folder;
    const std::string path = folder.write(
        "config.toml", "cluster = \"lab7:7410\"\nauthority = \"ca.crt\"\ncertificate = \"/etc/anna.crt\"\n");
    const Expected<UserSettings> settings = user_settings(path);
    REQUIRE(settings);
    CHECK(settings->cluster == "lab7:7410");
    CHECK(settings->authority == folder / "ca.crt");
    CHECK(settings->certificate == "/etc/anna.crt");
    CHECK(settings->key.empty());
    const Expected<UserSettings> none = user_settings(folder / "none.toml");
    REQUIRE(none);
    CHECK(none->cluster.empty());
  }

  TEST_CASE("user_settings: an error names the line") {
    const test::ScratchFolder folder;
    const std::string path = folder / "config.toml";
    folder.write("config.toml", "\ncluster = 3\n");
    check_error(user_settings(path), path + ":2", "is no text in quotes");
    folder.write("config.toml", "clutter = \"x\"\n");
    check_error(user_settings(path), path + ":1", "is none of cluster, authority, certificate, key");
    folder.write("config.toml", "\n\n= =\n");
    check_error(user_settings(path), path + ":3", "");
  }
}
