/// The rules of the house on the tree as it is. Each rule is first fed a fault it must catch, then every file.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/source_text.hpp"
#include "tests/support/tidy_rules.hpp"

namespace lichthof::tidy {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

const fs::path& root() {
  static const fs::path path = LICHTHOF_SOURCE_DIR;
  return path;
}

/// Every hand-written text file of the project, in the order of its path.
const std::vector<SourceFile>& tree() {
  static const std::vector<SourceFile> files = [] {
    std::set<std::string> paths;
    for (const char* folder : {".ci", "actors", "apps", "bench", "cmake", "config", "core", "deploy", "docs", "io",
                               "scenes", "sim", "tests", "web"})
      if (fs::is_directory(root() / folder))
        for (const auto& entry : fs::recursive_directory_iterator(root() / folder))
          if (entry.is_regular_file()) paths.insert(entry.path().lexically_relative(root()).generic_string());
    for (const auto& entry : fs::directory_iterator(root()))
      if (entry.is_regular_file()) paths.insert(entry.path().filename().string());
    std::vector<SourceFile> found;
    for (const auto& path : paths)
      if (is_written_by_hand(path)) found.push_back(source_file(path, read(root() / path)));
    return found;
  }();
  return files;
}

/// Applies a rule to the whole tree and reports all findings in one failure.
void expect_clean(const Rule& rule) {
  Strings all;
  for (const auto& file : tree()) {
    const Strings found = rule(file);
    all.insert(all.end(), found.begin(), found.end());
  }
  CHECK_MESSAGE(all.empty(), joined(all));
}

/// Whether the rule objects to a file at `path` holding `text`.
bool objects(const Rule& rule, const std::string& path, const std::string& text) {
  return !rule(source_file(path, text)).empty();
}

BuildLists build_lists() {
  BuildLists lists;
  for (const auto& file : tree())
    if (ends(file.path, "CMakeLists.txt")) {
      std::string text;
      for (const auto& line : file.lines) text += line.substr(0, line.find('#')) + "\n";
      lists.emplace_back(file.path.substr(0, file.path.size() - std::string_view("CMakeLists.txt").size()), text);
    }
  return lists;
}

SourceFile paper_map() { return source_file("docs/paper_map.md", read(root() / "docs/paper_map.md")); }

Strings all_case_names() {
  Strings names;
  for (const auto& file : tree())
    if (begins(file.path, "tests/") && ends(file.path, ".cpp") && file.path != "tests/tidy_test.cpp") {
      const Strings found = case_names(file);
      names.insert(names.end(), found.begin(), found.end());
    }
  return names;
}

}  // namespace

TEST_SUITE("tidy") {
  TEST_CASE("tidy: includes follow the directions of the house") {
    const Rule& rule = include_faults;
    CHECK(objects(rule, "core/base/ids.hpp", "#include \"core/scene/scene.hpp\"\n"));
    CHECK(objects(rule, "core/scene/mesh.cpp", "#include \"core/light/hemicube.hpp\"\n"));
    CHECK(objects(rule, "core/light/transfer.cpp", "#include \"core/protocol/messages.hpp\"\n"));
    CHECK(objects(rule, "core/protocol/messages.hpp", "#include \"core/cell/cell.hpp\"\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include \"core/tracing/worker.hpp\"\n"));
    CHECK(objects(rule, "core/tracing/worker.cpp", "#include \"core/cluster/node.hpp\"\n"));
    CHECK(objects(rule, "core/cluster/node.cpp", "#include \"core/cell/cell.hpp\"\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include \"sim/simulation.hpp\"\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include \"routing.hpp\"\n"));
    CHECK(objects(rule, "sim/simulation.cpp", "#include \"actors/wire.hpp\"\n"));
    CHECK(objects(rule, "sim/simulation.cpp", "#include \"io/scene_file.hpp\"\n"));
    CHECK(objects(rule, "io/obj_reader.cpp", "#include \"actors/wire.hpp\"\n"));
    CHECK(objects(rule, "actors/wire.hpp", "#include \"io/scene_file.hpp\"\n"));
    CHECK(objects(rule, "apps/main.cpp", "#include \"tests/support/scenes.hpp\"\n"));
    CHECK(objects(rule, "stray/main.cpp", "\n"));
    CHECK_FALSE(objects(rule, "core/cell/cell.cpp",
                        "#include \"core/cell/routing.hpp\"\n#include \"core/light/hemicube.hpp\"\n"));
    CHECK_FALSE(objects(rule, "apps/main.cpp", "#include \"sim/simulation.hpp\"\n#include \"io/scene_file.hpp\"\n"));
    expect_clean(rule);
  }

  TEST_CASE("tidy: each library is included only where it belongs") {
    const Rule& rule = include_faults;
    CHECK(objects(rule, "core/light/transfer.cpp", "#include <embree3/rtcore.h>\n"));
    CHECK(objects(rule, "core/light/transfer.cpp", "  #  include <tbb/parallel_for.h>\n"));
    CHECK(objects(rule, "core/light/transfer.cpp", "#include <zstd.h>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <caf/all.hpp>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <spdlog/spdlog.h>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <fstream>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <mutex>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <unordered_map>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <random>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <unistd.h>\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "#include <boost/optional.hpp>\n"));
    CHECK(objects(rule, "sim/simulation.cpp", "#include <caf/all.hpp>\n"));
    CHECK(objects(rule, "io/obj_reader.cpp", "#include <caf/all.hpp>\n"));
    CHECK(objects(rule, "actors/wire.hpp", "#include <OpenImageIO/imageio.h>\n"));
    CHECK(objects(rule, "actors/wire.hpp", "#include <openssl/ssl.h>\n"));
    CHECK(objects(rule, "apps/render.cpp", "#include <httplib.h>\n"));
    CHECK(objects(rule, "apps/node.cpp", "#include <systemd/sd-bus.h>\n"));
    CHECK(objects(rule, "apps/node.cpp", "#include <prometheus/registry.h>\n"));
    CHECK(objects(rule, "apps/shell.cpp", "#include <histedit.h>\n"));
    CHECK_FALSE(objects(rule, "core/light/raycast.cpp", "#include <embree3/rtcore.h>\n"));
    CHECK_FALSE(objects(rule, "core/base/parallel.cpp", "#include <tbb/parallel_for.h>\n"));
    CHECK_FALSE(objects(rule, "actors/wire.hpp", "#include <caf/all.hpp>\n#include <vector>\n"));
    CHECK_FALSE(objects(rule, "actors/link/tls.cpp", "#include <openssl/ssl.h>\n"));
    CHECK_FALSE(objects(rule, "core/cell/cell.cpp", "// #include <mutex>\n#include <glm/vec3.hpp>\n"));
  }

  TEST_CASE("tidy: core and sim have no clock, no chance, no lock and no order by address") {
    const Rule& rule = hidden_input_faults;
    CHECK(objects(rule, "core/cell/cell.cpp", "std::unordered_map<int, int> m;\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "int i = std::rand();\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "std::uniform_real_distribution<double> d;\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "auto t = std::chrono::steady_clock::now();\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "auto t = now();\n"));
    CHECK(objects(rule, "core/cell/cell.cpp", "std::mutex m;\n"));
    CHECK(objects(rule, "sim/simulation.cpp", "using std::chrono::system_clock;\n"));
    CHECK_FALSE(
        objects(rule, "core/cell/cell.cpp", "Effects step(Instant now);  // not now()\nauto s = \"rand()\";\n"));
    CHECK_FALSE(objects(rule, "actors/cell_actor.cpp", "auto t = std::chrono::steady_clock::now();\n"));
    expect_clean(rule);
  }

  TEST_CASE("tidy: no tabs, no long lines, nothing unfinished, nothing disabled") {
    const Rule& rule = form_faults;
    CHECK(objects(rule, "core/a.cpp", "\tint i;\n"));
    CHECK(objects(rule, "core/a.cpp", "int i; \n"));
    CHECK(objects(rule, "core/a.cpp", "int i;\r\n"));
    CHECK(objects(rule, "core/a.cpp", std::string(longest_line + 1, 'x') + "\n"));
    CHECK(objects(rule, "core/a.cpp", std::string("#if") + " 0\n#endif\n"));
    CHECK(objects(rule, "core/a.cpp", std::string("// TO") + "DO: later\n"));
    CHECK(objects(rule, "docs/a.md", std::string("FIX") + "ME\n"));
    CHECK(objects(rule, "core/a.cpp", "int i;"));
    CHECK(objects(rule, "core/a.cpp", "int i;\n\n"));
    CHECK(objects(rule, "core/a.hpp", "/// What it is.\nint i;\n"));
    CHECK(objects(rule, "core/a.hpp", "#pragma once\n"));
    std::string widest;
    for (std::size_t i = 0; i < longest_line; ++i) widest += "§";
    CHECK_FALSE(objects(rule, "core/a.cpp", widest + "\n"));
    CHECK_FALSE(objects(rule, "core/a.hpp", "/// What it is.\n#pragma once\n"));
    expect_clean(rule);
  }

  TEST_CASE("tidy: the words are those of the house") {
    const Rule& rule = word_faults;
    CHECK(objects(rule, "core/tracing/worker.cpp", "int tile_width_px;\n"));
    CHECK(objects(rule, "actors/cell_actor.cpp", "// the Master decides\n"));
    CHECK(objects(rule, "core/light/a.cpp", "double formfactor;\n"));
    CHECK(objects(rule, "io/a.cpp", "#include \"io/string_utils.hpp\"\n"));
    CHECK_FALSE(objects(rule, "core/tracing/worker.cpp", "// quantile, utility, form factor\n"));
    expect_clean(rule);
  }

  TEST_CASE("tidy: every source is listed in a build file") {
    const BuildLists example = {{"core/", "add_library(lichthof_core\n  light/transfer.cpp)\n"}};
    CHECK(unlisted_source_faults(source_file("core/light/transfer.cpp", "\n"), example).empty());
    CHECK_FALSE(unlisted_source_faults(source_file("core/light/fer.cpp", "\n"), example).empty());
    CHECK_FALSE(unlisted_source_faults(source_file("core/transfer.cpp", "\n"), example).empty());
    CHECK_FALSE(unlisted_source_faults(source_file("io/light/transfer.cpp", "\n"), example).empty());
    CHECK(objects(glob_faults, "core/CMakeLists.txt", "file(GLOB sources *.cpp)\n"));
    const BuildLists lists = build_lists();
    expect_clean([&](const SourceFile& file) { return unlisted_source_faults(file, lists); });
    expect_clean(glob_faults);
  }

  TEST_CASE("tidy: every claim of the paper map has its files and its tests") {
    const std::string head = "| claim | files | tests | status |\n|---|---|---|---|\n";
    const auto faults = [&](const std::string& row) {
      return claim_faults(source_file("map.md", head + row), {"§2: light is kept"},
                          [](const std::string& path) { return path == "a.cpp"; });
    };
    CHECK(faults("| kept | `a.cpp` | `§2: light is kept` | done |\n").empty());
    CHECK(faults("| kept | `b.cpp` | `§2: light is lost` | open |\n").empty());
    CHECK(faults("| kept | `b.cpp` | `§2: light is kept` | done |\n").size() == 1);
    CHECK(faults("| kept | `a.cpp` | `§2: light is lost` | done |\n").size() == 1);
    CHECK(faults("| kept | `a.cpp` | | later |\n").size() == 1);
    CHECK(faults("| kept | `a.cpp` | `§2: light is kept` | nearly |\n").size() == 1);
    CHECK_FALSE(faults("| kept | `a.cpp` | done |\n").empty());

    const SourceFile map = paper_map();
    const Strings names = all_case_names();
    const Strings found = claim_faults(map, names, [](const std::string& path) { return fs::exists(root() / path); });
    CHECK_MESSAGE(found.empty(), joined(found));
    REQUIRE(claims(map).size() > 30);
    Strings open;
    for (const auto& claim : claims(map)) {
      if (claim.status != "open") continue;
      const bool tested = std::all_of(claim.tests.begin(), claim.tests.end(),
                                      [&](const std::string& test) { return some_case(names, test); });
      open.push_back(finding(map, claim.line, claim.text + (tested ? " (its tests exist: done?)" : "")));
    }
    if (!open.empty()) MESSAGE(open.size(), " claims are open; a release has none:", joined(open));
  }

  TEST_CASE("tidy: every test that quotes the paper stands in the paper map") {
    const std::vector<Claim> listed = {{"kept", {}, {"light is kept"}, "done", 0}};
    const std::string macro = std::string("TEST_") + "CASE";
    CHECK(unclaimed_case_faults(source_file("tests/paper/a.cpp", macro + "(\"§2: light \"\n \"is kept\") {}\n"), listed)
              .empty());
    CHECK(
        unclaimed_case_faults(source_file("tests/core/a.cpp", macro + "(\"§2: light is lost\") {}\n"), listed).empty());
    CHECK_FALSE(unclaimed_case_faults(source_file("tests/paper/a.cpp", macro + "(\"§2: light is lost\") {}\n"), listed)
                    .empty());
    const std::vector<Claim> all = claims(paper_map());
    expect_clean([&](const SourceFile& file) { return unclaimed_case_faults(file, all); });
  }

  TEST_CASE("tidy: every citation stands in the bibliography") {
    const std::string bibliography = "@inproceedings{Known89,\n";
    const Rule example = [&](const SourceFile& file) { return citation_faults(file, bibliography); };
    CHECK(objects(example, "core/light/a.hpp", "/// @source [Unknown89]\n"));
    CHECK(objects(example, "docs/a.md", "after [Unknown89a]\n"));
    CHECK_FALSE(objects(example, "core/light/a.hpp", "/// @source [Known89], [0, 1], [m]\nint a = b[Index16];\n"));
    const std::string known = read(root() / "docs/references.bib");
    expect_clean([&](const SourceFile& file) { return citation_faults(file, known); });
  }

  TEST_CASE("tidy: CI runs the README's test command") {
    const std::string script = "#!/usr/bin/env bash\nset -e\ncd /\ndeploy/setup && run all\n";
    CHECK(command_faults(source_file("README.md", "Test:\n\n    deploy/setup && run all\n"), script).empty());
    CHECK_FALSE(command_faults(source_file("README.md", "    deploy/setup && run some\n"), script).empty());
    CHECK_FALSE(command_faults(source_file("README.md", "    deploy/setup && run all\n"), script + "more\n").empty());
    CHECK_FALSE(
        command_faults(source_file("README.md", "deploy/setup && run all\ncmake --preset release && ls\n"), script)
            .empty());
    const Strings found =
        command_faults(source_file("README.md", read(root() / "README.md")), read(root() / ".ci/run"));
    CHECK_MESSAGE(found.empty(), joined(found));
  }
}

}  // namespace lichthof::tidy
