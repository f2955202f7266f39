#include "io/text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>

namespace lichthof::io {

namespace {

/// A file descriptor that closes itself.
struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

std::string too_long(std::uint64_t max_bytes) {
  return "is longer than " + std::to_string(max_bytes >> 20) + " MiB, the most this kind of file may have";
}

}  // namespace

Expected<std::string> file_bytes(const std::string& path, std::uint64_t max_bytes) {
  // O_NONBLOCK: opening a pipe nobody writes to must not hang before its kind is known.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0) return bad_input(path, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat info {};
  if (::fstat(file.fd, &info) != 0) return Error{ErrorCode::io, path, std::strerror(errno)};
  if (S_ISDIR(info.st_mode)) return bad_input(path, "is a folder; a file was expected");
  if (!S_ISREG(info.st_mode) && !S_ISFIFO(info.st_mode)) return bad_input(path, "is a device; a file was expected");
  if (S_ISREG(info.st_mode) && static_cast<std::uint64_t>(info.st_size) > max_bytes)
    return bad_input(path, too_long(max_bytes));
  ::fcntl(file.fd, F_SETFL, 0);

  std::string bytes;
  if (S_ISREG(info.st_mode)) bytes.reserve(static_cast<std::size_t>(info.st_size) + 1);
  std::string chunk(1 << 20, '\0');
  for (;;) {
    const ssize_t got = ::read(file.fd, chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Error{ErrorCode::io, path, std::string("cannot be read: ") + std::strerror(errno)};
    if (got == 0) return bytes;
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
    if (bytes.size() > max_bytes) return bad_input(path, too_long(max_bytes));
  }
}

Expected<std::string> file_text(const std::string& path, std::uint64_t max_bytes) {
  Expected<std::string> text = file_bytes(path, max_bytes);
  if (!text) return text;
  if (const std::size_t zero = text->find('\0'); zero != std::string::npos)
    return bad_input(path, "is not a text file: byte " + std::to_string(zero) + " is zero");
  if (text->starts_with("\xEF\xBB\xBF")) text->erase(0, 3);
  return text;
}

bool Lines::next() {
  if (at_ >= text_.size()) return false;
  const std::size_t begin = at_;
  number_ = lines_read_ + 1;
  for (;;) {
    std::size_t end = text_.find('\n', at_);
    if (end == std::string::npos) end = text_.size();
    at_ = end + 1;
    ++lines_read_;
    std::size_t last = end;
    while (last > begin && (text_[last - 1] == '\r' || text_[last - 1] == ' ' || text_[last - 1] == '\t')) --last;
    if (joined_ && last > begin && text_[last - 1] == '\\' && at_ < text_.size()) {
      // The continuation becomes blanks in place, so that a joined line stays one view.
      for (std::size_t i = last - 1; i <= end; ++i) text_[i] = ' ';
      continue;
    }
    line_ = std::string_view(text_).substr(begin, last - begin);
    return true;
  }
}

std::string_view next_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return rest = {};
  std::size_t end = rest.find_first_of(" \t", begin);
  if (end == std::string_view::npos) end = rest.size();
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

namespace {

/// from_chars takes no plus.
std::string_view without_plus(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

}  // namespace

bool is_of_pattern(std::string_view name, std::string_view pattern) {
  std::size_t n = 0, p = 0, star = std::string_view::npos, resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++, resume = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++n, ++p;
    } else if (star != std::string_view::npos) {
      // The last star takes one character more.
      p = star + 1, n = ++resume;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

bool parse_number(std::string_view word, double& value) {
  word = without_plus(word);
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return false;
  // Out of range leaves the value alone; strtod says whether it was too large (inf) or too small (0).
  if (problem == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
  return problem == std::errc() || problem == std::errc::result_out_of_range;
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  word = without_plus(word);
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  return problem == std::errc() && end == word.data() + word.size();
}

std::string shortest_number(double value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value + 0.0).ptr};  // + 0.0: no "-0"
}

std::string printable(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    // Bytes that have to follow: by the leading ones of the first byte. Overlong forms start with C0, C1, E0 or F0; the
    // few characters lost with the latter two are no names.
    const std::size_t more = lead >= 0xC2 && lead <= 0xDF ? 1 : lead > 0xE0 && lead < 0xF0 && lead != 0xED ? 2 : 0;
    bool good = lead >= 0x20 && lead < 0x7f;
    if (more > 0 && i + more < text.size()) {
      good = true;
      for (std::size_t k = 1; k <= more; ++k) good &= (static_cast<unsigned char>(text[i + k]) & 0xC0) == 0x80;
    }
    if (good)
      result += text.substr(i, more + 1);
    else
      result += '?';
    i += good ? more + 1 : 1;
  }
  return result;
}

std::string in_quotes(std::string_view piece) {
  constexpr std::size_t longest = 40;
  return "'" + printable(piece.substr(0, longest)) + (piece.size() > longest ? "...'" : "'");
}

std::string at_line(const std::string& path, std::uint64_t line) { return path + ":" + std::to_string(line); }

Error bad_input(std::string where, std::string message) {
  return {ErrorCode::bad_input, std::move(where), std::move(message)};
}

}  // namespace lichthof::io
