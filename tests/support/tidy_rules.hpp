/// The rules of the house that a machine can check, as functions from text to findings. CONTRIBUTING.md says why they exist.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/source_text.hpp"

namespace lichthof::tidy {

/// Who may include whom: folders, and libraries with the places that may know them. A header that core or sim includes
/// is standard C++ (a bare name), a library of the table, or part of the project.
Strings include_faults(const SourceFile& file);

/// Clocks, chance, locks, threads, files and unordered containers in core and sim.
Strings hidden_input_faults(const SourceFile& file);

constexpr std::size_t longest_line = 140;

/// Tabs, line ends and lengths, unfinished or disabled code, how a header begins.
Strings form_faults(const SourceFile& file);

/// Words the house does not use.
Strings word_faults(const SourceFile& file);

/// The text of every CMakeLists.txt by its folder ("" for the root, else with a slash at the end).
using BuildLists = std::vector<std::pair<std::string, std::string>>;

/// A source that no CMakeLists.txt of its own or a higher folder names is neither built nor tested.
Strings unlisted_source_faults(const SourceFile& file, const BuildLists& lists);

/// Sources that are globbed instead of listed.
Strings glob_faults(const SourceFile& file);

/// One claim of the paper: where it is implemented and which test cases show it.
struct Claim {
  std::string text;
  Strings files;
  Strings tests;  ///< names of test cases, or parts of them
  std::string status;
  std::size_t line = 0;
};

/// The rows of every table `| claim | files | tests | status |`, however its header words them.
std::vector<Claim> claims(const SourceFile& map);

/// The names of all test cases in a test source; adjacent literals are joined.
Strings case_names(const SourceFile& file);

/// Whether the name of one of the test cases contains `fragment`.
bool some_case(const Strings& names, const std::string& fragment);

/// A claim is `done` (files and tests exist), `open` (to be done before a release) or `later` (another milestone).
Strings claim_faults(const SourceFile& map, const Strings& names,
                     const std::function<bool(const std::string&)>& exists);

/// A case of tests/paper that quotes a section must stand in the map: else it proves something nobody claimed.
Strings unclaimed_case_faults(const SourceFile& file, const std::vector<Claim>& listed);

/// Keys in square brackets that the bibliography lacks. In C++ only comments and literals cite.
Strings citation_faults(const SourceFile& file, const std::string& bibliography);

/// The README shows CI's command word for word, and each of its build commands starts from a bare machine.
Strings command_faults(const SourceFile& readme, const std::string& ci_script);

}  // namespace lichthof::tidy
