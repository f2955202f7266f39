/// The systemd units and scripts of deploy/, judged by systemd and shellcheck themselves.
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <regex>

#include "tests/system/program.hpp"

using namespace lichthof;
using namespace lichthof::testing;

namespace {

const std::string deploy = LICHTHOF_SOURCE_DIR "/deploy/";

struct Said {
  int status;
  std::string text;
};
Said said(const Folder& folder, const std::string& command) {
  const int status = std::system((command + " >'" + (folder / "said") + "' 2>&1 </dev/null").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder / "said")};
}

/// A unit that starts the program as it was built: systemd looks whether it is there.
std::string unit(const Folder& folder, const std::string& name) {
  const std::string text = contents(deploy + "systemd/" + name);
  REQUIRE(text.find("ExecStart=lichthof ") != std::string::npos);
  return folder.write(name, std::regex_replace(text, std::regex("ExecStart=lichthof "),
                                               std::string("ExecStart=") + LICHTHOF_PROGRAM + " "));
}

}  // namespace

TEST_SUITE("system") {
  TEST_CASE("units: systemd finds nothing wrong with them, and little that they might do") {
    for (const std::string kind : {"controller", "node"}) {
      const Folder folder;
      const std::string path = unit(folder, "lichthof-" + kind + ".service");
      CAPTURE(kind);
      const Said verified = said(folder, "systemd-analyze verify --man=no '" + path + "'");
      CHECK(verified.status == 0);
      CHECK(verified.text == "");
      // In tenths; a service without any protection has 96.
      const Said secure = said(folder, "systemd-analyze security --offline=true --threshold=20 '" + path + "'");
      CHECK(secure.status == 0);
      // systemd names a setting that it does not know, so the test of it is one.
      folder.write("lichthof-" + kind + ".service", contents(path) + "\n[Service]\nNoNewPriviliges=yes\n");
      CHECK(said(folder, "systemd-analyze verify --man=no '" + path + "'").text.find("NoNewPriviliges") !=
            std::string::npos);
    }
  }

  TEST_CASE("units: they call the program by options that it has") {
    for (const std::string kind : {"controller", "node"}) {
      const std::string help = ran({kind, "--help"}).out,
                        text = contents(deploy + "systemd/lichthof-" + kind + ".service");
      std::smatch line;
      REQUIRE(std::regex_search(text, line, std::regex("ExecStart=lichthof " + kind + " (.*)")));
      const std::string call = line[1];
      const std::regex option("--[a-z-]+");
      for (std::sregex_iterator at(call.begin(), call.end(), option), end; at != end; ++at)
        CHECK_MESSAGE(help.find(at->str() + " ") != std::string::npos, at->str() << " is no option of " << kind);
      CHECK(call.ends_with(" $LICHTHOF_OPTIONS"));
    }
  }

  TEST_CASE("units: their user can be made") {
    const Folder folder;
    const Said made = said(folder, "systemd-sysusers --dry-run '" + deploy + "systemd/lichthof.conf'");
    CHECK(made.status == 0);
    CHECK(made.text.find("ignoring") == std::string::npos);
  }

  TEST_CASE("deploy: shellcheck finds nothing wrong with the scripts") {
    const Folder folder;
    std::string files;
    for (const char* file : {"install-lab", "install-host", "systemd/postinst", "slurm/lichthof.sbatch"})
      files += " '" + deploy + file + "'";
    const Said checked = said(folder, "shellcheck" + files);
    CHECK(checked.status == 0);
    CHECK(checked.text == "");
  }
}
