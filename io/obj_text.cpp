#include "io/obj_text.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t largest_file = 2ull << 30;
constexpr std::size_t longest_line = 4u << 20;
constexpr double largest_coordinate = 1e9;

// Keywords of the OBJ specification that say nothing about shaded polygons.
constexpr std::string_view silent_keywords[] = {
    "s",     "mg",    "lod",       "bevel",  "c_interp", "d_interp", "usemap", "maplib", "shadow_obj", "deg",  "bmat",
    "step",  "parm",  "trim",      "hole",   "scrv",     "sp",       "end",    "con",    "vp",         "call", "csh",
    "ctech", "stech", "trace_obj", "cstype", "cdc",      "cdp",      "bzp",    "bsp",    "res"};
constexpr std::string_view curve_keywords[] = {"l", "p", "curv", "curv2", "surf"};

bool among(std::string_view word, std::span<const std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

class Reader {
 public:
  Reader(const std::string& path, std::string text) : path_(path), lines_(std::move(text), true) {}
  Expected<ObjText> read();

 private:
  Error wrong(std::string message) const { return bad_input(at_line(path_, lines_.number()), std::move(message)); }
  std::optional<Error> line(std::string_view key, std::string_view rest);
  std::optional<Error> numbers(std::string_view key, std::string_view rest, int least, int most);
  std::optional<Error> face(std::string_view rest);
  std::optional<Error> corner(std::string_view word);
  std::optional<Error> index(std::string_view digits, const char* what, std::size_t defined, std::uint32_t& result);
  std::uint32_t named(std::string_view rest, std::map<std::string, std::uint32_t, std::less<>>& indices,
                      std::vector<ObjText::Name>& names) const;
  std::optional<Error> ranges() const;

  const std::string& path_;
  Lines lines_;
  ObjText obj_;
  double numbers_[7] = {};
  std::uint64_t normal_count_ = 0;
  std::uint32_t material_ = ObjText::none, group_ = ObjText::none;
  // Indices that point ahead are judged at the end; the largest of each kind and its line are enough.
  struct Highest {
    std::uint64_t index = 0;
    std::uint32_t line = 0;
  };
  Highest vertex_ahead_, texcoord_ahead_, normal_ahead_;
  std::map<std::string, std::uint32_t, std::less<>> material_indices_, group_indices_;
};

std::optional<Error> Reader::numbers(std::string_view key, std::string_view rest, int least, int most) {
  int count = 0;
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    if (word.starts_with('#')) break;
    if (count == most) return wrong(std::string(key) + " has more than " + std::to_string(most) + " numbers");
    if (!parse_number(word, numbers_[count]))
      return wrong(std::string(key) + " expects numbers, found " + in_quotes(word));
    if (!std::isfinite(numbers_[count]))
      return wrong(std::string(key) + " has a coordinate that is not finite: " + in_quotes(word));
    if (std::abs(numbers_[count]) > largest_coordinate)
      return wrong(std::string(key) + " has a coordinate beyond 1e9: " + in_quotes(word));
    ++count;
  }
  if (count < least)
    return wrong(std::string(key) + " expects " + std::to_string(least) + " numbers, found " + std::to_string(count));
  for (; count < 3; ++count) numbers_[count] = 0;
  return {};
}

/// @param result  index from 0; stays `none` for what the digits leave out
std::optional<Error> Reader::index(std::string_view digits, const char* what, std::size_t defined,
                                   std::uint32_t& result) {
  std::int64_t value = 0;
  if (!parse_integer(digits, value))
    return wrong(std::string("expected a ") + what + " index, found " + in_quotes(digits));
  if (value == 0) return wrong(std::string(what) + " index 0: indices count from 1");
  if (value < 0) value += static_cast<std::int64_t>(defined) + 1;
  if (value <= 0)
    return wrong(std::string(what) + " index " + in_quotes(digits) + " counts back beyond the first of " +
                 std::to_string(defined));
  if (value >= ObjText::none) return wrong(std::string(what) + " index " + in_quotes(digits) + " is out of range");
  result = static_cast<std::uint32_t>(value - 1);
  return {};
}

/// `v`, `v/t`, `v//n` or `v/t/n`.
std::optional<Error> Reader::corner(std::string_view word) {
  std::string_view parts[3];
  for (int part = 0; part < 3; ++part) {
    const std::size_t slash = word.find('/');
    parts[part] = word.substr(0, slash);
    word = slash == std::string_view::npos ? std::string_view() : word.substr(slash + 1);
    if (slash == std::string_view::npos) break;
    if (part == 2) return wrong("a corner of a face has more than two slashes");
  }
  const auto keep = [this](Highest& highest, std::uint64_t value) {
    if (value > highest.index) highest = {value, lines_.number()};
  };
  ObjText::Corner corner;
  std::uint32_t normal = 0;
  if (auto error = index(parts[0], "vertex", obj_.vertices.size(), corner.vertex)) return error;
  keep(vertex_ahead_, corner.vertex + 1ull);
  if (!parts[1].empty()) {
    if (auto error = index(parts[1], "texture coordinate", obj_.texcoords.size(), corner.texcoord)) return error;
    keep(texcoord_ahead_, corner.texcoord + 1ull);
  }
  if (!parts[2].empty()) {
    if (auto error = index(parts[2], "normal", normal_count_, normal)) return error;
    keep(normal_ahead_, normal + 1ull);
  }
  obj_.corners.push_back(corner);
  return {};
}

std::optional<Error> Reader::face(std::string_view rest) {
  const std::size_t first = obj_.corners.size();
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    if (word.starts_with('#')) break;
    if (auto error = corner(word)) return error;
  }
  const std::size_t count = obj_.corners.size() - first;
  if (count < 3) return wrong("a face needs at least 3 corners, found " + std::to_string(count));
  if (obj_.corners.size() >= ObjText::none) return wrong("more than 4 billion corners");
  obj_.faces.push_back(
      {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count), material_, lines_.number(), group_});
  return {};
}

/// The number of a name among those of its kind.
std::uint32_t Reader::named(std::string_view rest, std::map<std::string, std::uint32_t, std::less<>>& indices,
                            std::vector<ObjText::Name>& names) const {
  const std::string name(trimmed(rest));
  const auto [entry, is_new] = indices.try_emplace(name, static_cast<std::uint32_t>(names.size()));
  if (is_new) names.push_back({name, lines_.number()});
  return entry->second;
}

std::optional<Error> Reader::line(std::string_view key, std::string_view rest) {
  if (key == "v") {
    // Beyond the three coordinates: a weight, or colours some programs write.
    if (auto error = numbers(key, rest, 3, 7)) return error;
    obj_.vertices.push_back({numbers_[0], numbers_[1], numbers_[2]});
  } else if (key == "vt") {
    if (auto error = numbers(key, rest, 1, 3)) return error;
    obj_.texcoords.push_back({numbers_[0], numbers_[1]});
  } else if (key == "vn") {
    if (auto error = numbers(key, rest, 3, 3)) return error;
    ++normal_count_;
  } else if (key == "f" || key == "fo") {
    return face(rest);
  } else if (key == "usemtl") {
    material_ = named(rest, material_indices_, obj_.materials);
  } else if (key == "o" || key == "g") {
    group_ = trimmed(rest).empty() ? ObjText::none : named(rest, group_indices_, obj_.groups);
  } else if (key == "mtllib") {
    if (trimmed(rest).empty()) return wrong("mtllib expects the name of a file");
    obj_.libraries.push_back({std::string(trimmed(rest)), lines_.number()});
  } else if (among(key, curve_keywords)) {
    ++obj_.ignored_curves;
  } else if (!among(key, silent_keywords) && obj_.first_unknown.text.empty()) {
    obj_.first_unknown = {std::string(key), lines_.number()};
  }
  return {};
}

std::optional<Error> Reader::ranges() const {
  const auto check = [this](const Highest& highest, std::uint64_t defined, const char* what) -> std::optional<Error> {
    if (highest.index <= defined) return {};
    return bad_input(at_line(path_, highest.line), std::string(what) + " index " + std::to_string(highest.index) +
                                                       " is out of range: the file has " + std::to_string(defined));
  };
  if (auto error = check(vertex_ahead_, obj_.vertices.size(), "vertex")) return error;
  if (auto error = check(texcoord_ahead_, obj_.texcoords.size(), "texture coordinate")) return error;
  return check(normal_ahead_, normal_count_, "normal");
}

Expected<ObjText> Reader::read() {
  while (lines_.next()) {
    std::string_view rest = lines_.line();
    if (rest.size() > longest_line) return wrong("the line is longer than 4 MiB; is this an OBJ file?");
    const std::string_view key = next_word(rest);
    if (key.empty() || key.starts_with('#')) continue;
    if (auto error = line(key, rest)) return *error;
  }
  if (obj_.faces.empty() && !obj_.first_unknown.text.empty())
    return bad_input(
        at_line(path_, obj_.first_unknown.line),
        "is not an OBJ file: unknown keyword " + in_quotes(obj_.first_unknown.text) + " and no face (f) at all");
  if (obj_.faces.empty()) return bad_input(path_, "has no faces; lines starting with f were expected");
  if (auto error = ranges()) return *error;
  return std::move(obj_);
}

}  // namespace

Expected<ObjText> read_obj_text(const std::string& path) {
  Expected<std::string> text = file_text(path, largest_file);
  if (!text) return text.error();
  return Reader(path, std::move(*text)).read();
}

}  // namespace lichthof::io
