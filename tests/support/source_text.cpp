#include "tests/support/source_text.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

namespace lichthof::tidy {

bool begins(std::string_view text, std::string_view prefix) { return text.substr(0, prefix.size()) == prefix; }

bool ends(std::string_view text, std::string_view suffix) {
  return text.size() >= suffix.size() && text.substr(text.size() - suffix.size()) == suffix;
}

bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

bool contains(const Strings& list, std::string_view item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t") - first + 1));
}

Strings split(std::string_view text, char separator) {
  Strings parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

bool has_word(std::string_view line, std::string_view word) {
  for (auto at = line.find(word); at != std::string_view::npos; at = line.find(word, at + 1)) {
    const bool left = word.front() == '_' || at == 0 || !is_word(line[at - 1]);
    const auto after = at + word.size();
    const bool right = word.back() == '_' || !is_word(word.back()) || after == line.size() || !is_word(line[after]);
    if (left && right) return true;
  }
  return false;
}

namespace {

/// Blanks comments and the insides of string and character literals, keeping the line structure.
std::string without_comments_and_literals(const std::string& text) {
  std::string out = text;
  const auto blank = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < std::min(to, out.size()); ++i)
      if (out[i] != '\n') out[i] = ' ';
  };
  std::size_t i = 0;
  while (i < text.size()) {
    const std::string_view rest = std::string_view(text).substr(i);
    if (begins(rest, "//")) {
      const auto end = std::min(text.find('\n', i), text.size());
      blank(i, end);
      i = end;
    } else if (begins(rest, "/*")) {
      const auto end = std::min(text.find("*/", i + 2), text.size() - 2) + 2;
      blank(i, end);
      i = end;
    } else if (begins(rest, "R\"") && (i == 0 || !is_word(text[i - 1]))) {
      const auto open = text.find('(', i);
      const std::string close = ")" + text.substr(i + 2, open - i - 2) + "\"";
      const auto end = std::min(text.find(close, i), text.size() - close.size());
      blank(i + 2, end);
      i = end + close.size();
    } else if (text[i] == '"' || (text[i] == '\'' && (i == 0 || !is_word(text[i - 1])))) {
      std::size_t end = i + 1;
      while (end < text.size() && text[end] != text[i] && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
      blank(i + 1, end);
      i = end + 1;
    } else {
      ++i;
    }
  }
  return out;
}

}  // namespace

SourceFile source_file(std::string path, const std::string& text) {
  return {std::move(path), split(text, '\n'), split(without_comments_and_literals(text), '\n')};
}

std::string finding(const SourceFile& file, std::size_t line, const std::string& what) {
  return file.path + ":" + std::to_string(line + 1) + ": " + what;
}

bool is_cpp(std::string_view path) { return ends(path, ".cpp") || ends(path, ".hpp"); }

bool is_cmake(std::string_view path) { return ends(path, ".cmake") || ends(path, "CMakeLists.txt"); }

bool is_written_by_hand(std::string_view path) {
  return is_cpp(path) || is_cmake(path) || ends(path, ".py") || ends(path, ".sh") || ends(path, ".md") ||
         ends(path, ".toml") || ends(path, ".html") || begins(path, "deploy/") || begins(path, ".ci/");
}

bool begins_with_any(const std::string& path, const Strings& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& prefix) { return begins(path, prefix); });
}

std::string joined(const Strings& findings) {
  std::string text;
  for (const auto& line : findings) text += "\n  " + line;
  return text;
}

std::size_t width(const std::string& line) {
  return static_cast<std::size_t>(
      std::count_if(line.begin(), line.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace lichthof::tidy
