#include "tests/support/tidy_rules.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <string_view>

namespace lichthof::tidy {

// ---------------------------------------------------------------------------------------------------------------------
// Include directions

namespace {

/// A folder and the project folders its files may include, besides itself.
struct Folder {
  std::string path;
  Strings may_include;
};

const std::vector<Folder>& folders() {
  static const std::vector<Folder> table = [] {
    const Strings below = {"core/base/", "core/scene/", "core/light/", "core/protocol/"};
    return std::vector<Folder>{
        {"core/base/", {}},
        {"core/scene/", {"core/base/"}},
        {"core/light/", {"core/base/", "core/scene/"}},
        {"core/protocol/", {"core/base/", "core/scene/", "core/light/"}},
        {"core/cell/", below},
        {"core/tracing/", below},
        {"core/cluster/", below},
        {"sim/", {"core/"}},
        {"io/", {"core/"}},
        {"actors/", {"core/"}},
        {"apps/", {"core/", "io/", "actors/", "sim/", "bench/"}},
        {"tests/", {"core/", "io/", "actors/", "sim/", "apps/", "bench/"}},
        {"bench/", {"core/", "io/", "actors/", "sim/"}},
    };
  }();
  return table;
}

/// A header of a library, or the folder of its headers, and the only places that may include it.
struct Library {
  std::string header;
  Strings places;
};

const std::vector<Library>& libraries() {
  static const std::vector<Library> table = {
      {"glm/", {""}},
      {"embree3/", {"core/light/raycast.cpp"}},
      {"tbb/", {"core/base/parallel.cpp"}},
      {"oneapi/", {"core/base/parallel.cpp"}},
      {"zstd.h", {"core/light/hemicube_bitmap_wire.cpp", "io/", "tests/"}},
      {"immintrin.h", {"core/light/kernels/"}},
      {"caf/", {"actors/", "apps/", "tests/", "bench/"}},
      {"spdlog/", {"actors/", "apps/", "tests/", "bench/"}},
      {"openssl/", {"actors/link/", "tests/"}},
      {"OpenImageIO/", {"io/image_module.cpp"}},
      {"tiny_obj_loader.h", {"io/"}},
      {"tiny_gltf.h", {"io/"}},
      {"toml++/", {"io/"}},
      {"nlohmann/", {"io/", "apps/", "tests/", "bench/"}},
      {"CLI/", {"apps/"}},
      {"httplib.h", {"apps/cluster/", "tests/"}},
      {"prometheus/", {"apps/cluster/"}},
      {"systemd/", {"apps/cluster/owner_watch.cpp"}},
      {"histedit.h", {"apps/cluster/line_editor.cpp"}},
      {"ncurses.h", {"apps/top.cpp"}},
      {"doctest/", {"tests/"}},
      // Files, clocks, threads and chance stay out of core and sim (AUDIT and MUST may write their last line).
      {"fstream", {"io/", "actors/", "apps/", "tests/", "bench/"}},
      {"filesystem", {"io/", "actors/", "apps/", "tests/", "bench/"}},
      {"iostream", {"apps/", "tests/", "bench/"}},
      {"cstdio", {"core/base/check.hpp", "core/base/check.cpp", "io/", "actors/", "apps/", "tests/", "bench/"}},
      {"ctime", {"io/", "actors/", "apps/", "tests/", "bench/"}},
      {"random", {"tests/"}},
      {"thread", {"actors/", "apps/", "tests/", "bench/"}},
      {"mutex", {"actors/", "apps/", "tests/", "bench/"}},
      {"shared_mutex", {"actors/", "apps/", "tests/", "bench/"}},
      {"condition_variable", {"actors/", "apps/", "tests/", "bench/"}},
      {"future", {"actors/", "apps/", "tests/", "bench/"}},
      {"unordered_map", {"io/", "actors/", "apps/", "tests/", "bench/"}},
      {"unordered_set", {"io/", "actors/", "apps/", "tests/", "bench/"}},
  };
  return table;
}

/// What an `#include` line names, with its opening quote or bracket; empty for any other line.
std::string included(const std::string& line) {
  std::string text = trimmed(line);
  if (!begins(text, "#")) return {};
  text = trimmed(text.substr(1));
  if (!begins(text, "include")) return {};
  text = trimmed(text.substr(7));
  const auto close = text.empty() ? std::string::npos : text.find(text[0] == '<' ? '>' : '"', 1);
  return close == std::string::npos ? std::string{} : text.substr(0, close);
}

}  // namespace

Strings include_faults(const SourceFile& file) {
  Strings faults;
  const auto folder = std::find_if(folders().begin(), folders().end(),
                                   [&](const Folder& candidate) { return begins(file.path, candidate.path); });
  if (!is_cpp(file.path)) return faults;
  if (folder == folders().end()) return {finding(file, 0, "no folder of the house holds this file")};
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string name = included(file.lines[i]);
    if (name.empty()) continue;
    const std::string header = name.substr(1);
    if (name[0] == '"') {
      if (!begins(header, folder->path) && !begins_with_any(header, folder->may_include))
        faults.push_back(
            finding(file, i, folder->path + " may not include " + header + " (paths are written from the root)"));
      continue;
    }
    const auto library = std::find_if(libraries().begin(), libraries().end(), [&](const Library& candidate) {
      return ends(candidate.header, "/") ? begins(header, candidate.header) : header == candidate.header;
    });
    if (library != libraries().end()) {
      if (!begins_with_any(file.path, library->places))
        faults.push_back(finding(file, i, "<" + header + "> belongs to" + joined(library->places)));
    } else if ((begins(file.path, "core/") || begins(file.path, "sim/")) &&
               header.find_first_of("./") != std::string::npos) {
      faults.push_back(finding(file, i, "<" + header + "> is no header that core or sim may know"));
    }
  }
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// What core and sim may not touch

Strings hidden_input_faults(const SourceFile& file) {
  Strings faults;
  if (!is_cpp(file.path) || !(begins(file.path, "core/") || begins(file.path, "sim/"))) return faults;
  static const Strings words = {"unordered_",    "rand",     "srand",     "random_device", "mt19937",
                                "_distribution", "_clock",   "sleep_for", "std::mutex",    "lock_guard",
                                "std::thread",   "ofstream", "ifstream",  "fopen"};
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    for (const auto& word : words)
      if (has_word(file.code[i], word))
        faults.push_back(finding(file, i, word + ": order, chance, time, threads and files are given"));
    if (begins(file.path, "core/") && has_word(file.code[i], "now("))
      faults.push_back(finding(file, i, "now(): a machine is told the time"));
  }
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// Form

Strings form_faults(const SourceFile& file) {
  Strings faults;
  // Assembled from parts, so that this file does not find itself.
  static const Strings unfinished = {std::string("TO") + "DO", std::string("FIX") + "ME", std::string("XX") + "X",
                                     std::string("HA") + "CK"};
  static const std::string disabled = std::string("#if") + " 0";
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string& line = file.lines[i];
    if (contains(line, "\t")) faults.push_back(finding(file, i, "tab"));
    if (contains(line, "\r")) faults.push_back(finding(file, i, "carriage return"));
    if (ends(line, " ")) faults.push_back(finding(file, i, "space at the end"));
    if (width(line) > longest_line && !ends(file.path, ".md"))
      faults.push_back(finding(file, i, "longer than " + std::to_string(longest_line) + " characters"));
    if (begins(trimmed(line), disabled))
      faults.push_back(finding(file, i, "disabled code: what is removed is removed"));
    for (const auto& word : unfinished)
      if (has_word(line, word)) faults.push_back(finding(file, i, word + ": finish it, or open an issue"));
  }
  if (file.lines.size() < 2 || !file.lines.back().empty() || file.lines[file.lines.size() - 2].empty())
    faults.push_back(finding(file, file.lines.size() - 1, "a file ends with one line end"));
  if (ends(file.path, ".hpp") && !contains(file.lines, "#pragma once"))
    faults.push_back(finding(file, 0, "no #pragma once"));
  if (ends(file.path, ".hpp") && !begins(file.lines[0], "//"))
    faults.push_back(finding(file, 0, "a header opens with what it is for"));
  return faults;
}

namespace {

/// A word the house does not use, what it says instead, and where the rule holds.
struct HouseWord {
  std::string banned;
  std::string instead;
  Strings places;
};

const std::vector<HouseWord>& house_words() {
  static const Strings everywhere = {"core/", "io/", "actors/", "sim/", "apps/"};
  static const std::vector<HouseWord> table = {
      {"tile", "column (of the second pass)", {"core/tracing/", "core/cluster/", "core/protocol/", "actors/", "sim/"}},
      {"tiles",
       "columns (of the second pass)",
       {"core/tracing/", "core/cluster/", "core/protocol/", "actors/", "sim/"}},
      {"master", "controller", everywhere},
      {"slave", "worker", everywhere},
      {"slaves", "workers", everywhere},
      {"hemi-cube", "hemicube", everywhere},
      {"hemi_cube", "hemicube", everywhere},
      {"formfactor", "form factor, form_factor", everywhere},
      {"subdomain", "cell", everywhere},
      {"visibility mask", "hemicube bitmap", everywhere},
      {"util", "the noun the file is about", everywhere},
      {"utils", "the noun the file is about", everywhere},
      {"helper", "the noun the function computes", everywhere},
      {"helpers", "the noun the function computes", everywhere},
  };
  return table;
}

}  // namespace

Strings word_faults(const SourceFile& file) {
  Strings faults;
  if (!is_cpp(file.path)) return faults;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::string line = file.lines[i];
    for (char& c : line) c = c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const auto& word : house_words()) {
      std::string banned = word.banned;
      std::replace(banned.begin(), banned.end(), '_', ' ');
      if (begins_with_any(file.path, word.places) && has_word(line, banned))
        faults.push_back(finding(file, i, "'" + word.banned + "': the house says " + word.instead));
    }
  }
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// Build lists

Strings unlisted_source_faults(const SourceFile& file, const BuildLists& lists) {
  if (!ends(file.path, ".cpp")) return {};
  for (const auto& [folder, text] : lists) {
    if (!begins(file.path, folder)) continue;
    const std::string name = file.path.substr(folder.size());
    for (auto at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
      const char before = at == 0 ? ' ' : text[at - 1];
      if (!is_word(before) && before != '.' && (before != '/' || ends(text.substr(0, at), "_DIR}/"))) return {};
    }
  }
  return {finding(file, 0, "no CMakeLists.txt lists this source")};
}

Strings glob_faults(const SourceFile& file) {
  Strings faults;
  for (std::size_t i = 0; is_cmake(file.path) && i < file.lines.size(); ++i)
    if (has_word(file.lines[i], "GLOB") || has_word(file.lines[i], "GLOB_RECURSE"))
      faults.push_back(finding(file, i, "sources are listed, never globbed"));
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// The paper map

namespace {

/// The texts between pairs of back quotes.
Strings quoted(const std::string& cell) {
  const Strings parts = split(cell, '`');
  Strings texts;
  for (std::size_t i = 1; i + 1 < parts.size(); i += 2) texts.push_back(parts[i]);
  return texts;
}

}  // namespace

std::vector<Claim> claims(const SourceFile& map) {
  std::vector<Claim> found;
  bool in_table = false;
  for (std::size_t i = 0; i < map.lines.size(); ++i) {
    const std::string& line = map.lines[i];
    if (!begins(line, "|")) in_table = false;
    if (begins(line, "|---")) in_table = true;
    if (!in_table || begins(line, "|---")) continue;
    const Strings cells = split(line, '|');
    if (cells.size() != 6) {
      found.push_back({line, {}, {}, "not four columns", i});
      continue;
    }
    found.push_back({trimmed(cells[1]), quoted(cells[2]), quoted(cells[3]), trimmed(cells[4]), i});
  }
  return found;
}

Strings case_names(const SourceFile& file) {
  std::string text;
  for (const auto& line : file.lines) text += line + "\n";
  static const std::string opening = std::string("TEST_") + "CASE";
  Strings names;
  for (auto at = text.find(opening); at != std::string::npos; at = text.find(opening, at + 1)) {
    at = text.find('(', at);
    if (at == std::string::npos) break;
    std::string name;
    std::size_t i = at + 1;
    for (;;) {
      while (i < text.size() && std::isspace(static_cast<unsigned char>(text[i])) != 0) ++i;
      if (i >= text.size() || text[i] != '"') break;
      for (++i; i < text.size() && text[i] != '"'; ++i) {
        if (text[i] == '\\') ++i;
        name += text[i];
      }
      ++i;
    }
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

bool some_case(const Strings& names, const std::string& fragment) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return contains(name, fragment); });
}

Strings claim_faults(const SourceFile& map, const Strings& names,
                     const std::function<bool(const std::string&)>& exists) {
  Strings faults;
  for (const auto& claim : claims(map)) {
    if (claim.status != "done" && claim.status != "open" && claim.status != "later")
      faults.push_back(finding(map, claim.line, "status '" + claim.status + "' is none of done, open, later"));
    if (claim.files.empty() || claim.tests.empty())
      faults.push_back(finding(map, claim.line, "a claim names its files and its tests"));
    if (claim.status != "done") continue;
    for (const auto& path : claim.files)
      if (!exists(path)) faults.push_back(finding(map, claim.line, "no file " + path));
    for (const auto& test : claim.tests)
      if (!some_case(names, test)) faults.push_back(finding(map, claim.line, "no test case \"" + test + "\""));
  }
  return faults;
}

Strings unclaimed_case_faults(const SourceFile& file, const std::vector<Claim>& listed) {
  Strings faults;
  if (!begins(file.path, "tests/paper/")) return faults;
  for (const auto& name : case_names(file)) {
    const bool claimed = std::any_of(listed.begin(), listed.end(), [&](const Claim& claim) {
      return std::any_of(claim.tests.begin(), claim.tests.end(),
                         [&](const std::string& test) { return contains(name, test); });
    });
    if (begins(name, "§") && !claimed)
      faults.push_back(finding(file, 0, "docs/paper_map.md has no claim for \"" + name + "\""));
  }
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// Citations

namespace {

/// Keys like `Baum89` in square brackets: letters, two digits, perhaps a letter.
Strings citations(const std::string& text) {
  Strings keys;
  for (auto at = text.find('['); at != std::string::npos; at = text.find('[', at + 1)) {
    const auto close = text.find(']', at);
    if (close == std::string::npos) break;
    const std::string key = text.substr(at + 1, close - at - 1);
    const auto digits = key.find_first_of("0123456789");
    if (key.size() < 4 || digits == std::string::npos || digits < 2 ||
        std::isupper(static_cast<unsigned char>(key[0])) == 0)
      continue;
    const bool letters = std::all_of(key.begin(), key.begin() + static_cast<std::ptrdiff_t>(digits),
                                     [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; });
    const std::string year = key.substr(digits);
    const bool dated =
        (year.size() == 2 || (year.size() == 3 && std::islower(static_cast<unsigned char>(year[2])) != 0)) &&
        std::isdigit(static_cast<unsigned char>(year[1])) != 0;
    if (letters && dated) keys.push_back(key);
  }
  return keys;
}

}  // namespace

Strings citation_faults(const SourceFile& file, const std::string& bibliography) {
  Strings faults;
  if ((!is_cpp(file.path) && !ends(file.path, ".md")) || begins(file.path, "tests/tidy_")) return faults;
  for (std::size_t i = 0; i < file.lines.size(); ++i)
    for (const auto& key : citations(file.lines[i]))
      if (!(is_cpp(file.path) && contains(file.code[i], "[" + key + "]")) && !contains(bibliography, "{" + key + ","))
        faults.push_back(finding(file, i, "docs/references.bib does not know [" + key + "]"));
  return faults;
}

// ---------------------------------------------------------------------------------------------------------------------
// Commands

namespace {

/// The lines of a shell script that do something besides finding their place.
Strings commands(const std::string& script) {
  Strings found;
  for (const auto& line : split(script, '\n')) {
    const std::string text = trimmed(line);
    if (!text.empty() && !begins(text, "#") && !begins(text, "set ") && !begins(text, "cd ")) found.push_back(text);
  }
  return found;
}

}  // namespace

Strings command_faults(const SourceFile& readme, const std::string& ci_script) {
  Strings faults;
  const Strings ci = commands(ci_script);
  Strings shown;
  for (const auto& line : readme.lines) shown.push_back(trimmed(line));
  if (ci.size() != 1 || !contains(shown, ci.empty() ? "" : ci[0]))
    faults.push_back(".ci/run must be the README's test command: " + joined(ci));
  for (std::size_t i = 0; i < shown.size(); ++i)
    if (contains(shown[i], "--preset release ") && contains(shown[i], "&&") && !begins(shown[i], "deploy/setup && "))
      faults.push_back(finding(readme, i, "a command for a bare machine begins with deploy/setup"));
  return faults;
}

}  // namespace lichthof::tidy
