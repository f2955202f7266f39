/// Text files, defensively: bounded reading, lines with their numbers, exact numbers, and quoting that keeps a message on
/// one printable line whatever the file held.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/expected.hpp"

namespace lichthof::io {

/// The bytes of a file.
/// @param max_bytes  beyond it the file is refused before memory is taken
/// @error bad_input: does not exist, is a folder or a device, is too long; io: the system could not read it
Expected<std::string> file_bytes(const std::string& path, std::uint64_t max_bytes);

/// The same for text: also refuses files with NUL bytes, which are binary. A UTF-8 byte order mark is dropped.
Expected<std::string> file_text(const std::string& path, std::uint64_t max_bytes);

/// Walks the lines of a text it owns. Line ends: LF, CRLF; trailing blanks are cut.
class Lines {
 public:
  /// @param joined  a backslash at the end of a line continues it (OBJ, MTL)
  explicit Lines(std::string text, bool joined = false) : text_(std::move(text)), joined_(joined) {}

  /// Moves to the next line. @returns false at the end
  bool next();
  std::string_view line() const { return line_; }
  /// Number of the current line, from 1; of its first line where it was continued.
  std::uint32_t number() const { return number_; }

 private:
  std::string text_;
  std::string_view line_;
  std::size_t at_ = 0;
  std::uint32_t number_ = 0, lines_read_ = 0;
  bool joined_;
};

/// Cuts the first word (blanks and tabs separate) off `rest`; empty when there is none.
std::string_view next_word(std::string_view& rest);

/// Without blanks and tabs at both ends.
std::string_view trimmed(std::string_view text);

/// Whether a whole name is of a pattern: `*` stands for any characters, `?` for one.
bool is_of_pattern(std::string_view name, std::string_view pattern);

/// Reads a whole word as a number, correctly rounded; "nan" and "inf" are numbers here. @returns false: not a number
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, std::int64_t& value);

/// The shortest text that reads back as the same number.
std::string shortest_number(double value);

/// Valid UTF-8 without control characters: whatever else was there is a question mark.
std::string printable(std::string_view text);

/// A piece of a file inside quotes, made printable and cut to about 40 characters.
std::string in_quotes(std::string_view piece);

/// "file:line".
std::string at_line(const std::string& path, std::uint64_t line);

/// An Error of bad input.
Error bad_input(std::string where, std::string message);

}  // namespace lichthof::io
