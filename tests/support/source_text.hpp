/// Source files as text for the tidy tests: lines, words, and code without comments and literals. Knows no rule.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace lichthof::tidy {

using Strings = std::vector<std::string>;

/// A file of the project: its path from the root, its lines, and the same lines without comments and literals.
struct SourceFile {
  std::string path;
  Strings lines;
  Strings code;
};

/// A rule of the house: the findings in one file, none if it keeps the rule.
using Rule = std::function<Strings(const SourceFile&)>;

SourceFile source_file(std::string path, const std::string& text);

/// "path:line: what" for the line of that index.
std::string finding(const SourceFile& file, std::size_t line, const std::string& what);

bool begins(std::string_view text, std::string_view prefix);
bool begins_with_any(const std::string& text, const Strings& prefixes);
bool ends(std::string_view text, std::string_view suffix);
bool contains(std::string_view text, std::string_view part);
bool contains(const Strings& list, std::string_view item);

/// Whether a character may stand inside a C++ identifier.
bool is_word(char c);

/// Whether `word` stands in `line` on its own; a word ending in `_` matches as a beginning, one starting with `_` as an
/// end.
bool has_word(std::string_view line, std::string_view word);

std::string trimmed(std::string_view text);
Strings split(std::string_view text, char separator);

/// One item per line, each on a line of its own.
std::string joined(const Strings& items);

/// Characters, not bytes: continuation bytes of UTF-8 don't count.
std::size_t width(const std::string& line);

bool is_cpp(std::string_view path);
bool is_cmake(std::string_view path);
bool is_written_by_hand(std::string_view path);

}  // namespace lichthof::tidy
