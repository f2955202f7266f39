#include "apps/common/options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include "core/base/check.hpp"
#include "core/scene/partition.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

constexpr std::array<std::pair<const char*, Method>, 5> method_table{{{"two-pass", Method::two_pass},
                                                                      {"radiosity", Method::radiosity},
                                                                      {"raytrace", Method::raytrace},
                                                                      {"hemicube", Method::hemicube},
                                                                      {"reference", Method::reference}}};

constexpr std::int64_t longest_side = 65536, most_pixels = std::int64_t{1} << 28;

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

CLI::Validator cells_text() {
  return {[](std::string& text) {
            const Expected<CellsWanted> cells = cells_wanted(text);
            return cells ? std::string() : cells.error().message;
          },
          "", "cells"};
}

CLI::Validator hemicube_text() {
  return {[](std::string& text) {
            std::int64_t pixels = 0;
            const bool good = io::parse_integer(text, pixels) && pixels >= 8 && pixels <= 1024 && pixels % 2 == 0;
            return good ? std::string() : io::in_quotes(text) + " is no even number from 8 to 1024";
          },
          "", "hemicube"};
}

}  // namespace

std::string FirstPassOptions::mesh_given() const {
  std::vector<std::string> names;
  if (patch) names.push_back("--patch");
  if (element) names.push_back("--element");
  if (elements) names.push_back("--elements");
  return joined(names, " ");
}

std::string FirstPassOptions::given() const {
  std::vector<std::string> names;
  if (cells) names.push_back("--cells");
  if (eps) names.push_back("--eps");
  if (hemicube) names.push_back("--hemicube");
  if (const std::string mesh = mesh_given(); !mesh.empty()) names.push_back(mesh);
  return joined(names, " ");
}

CLI::Validator number_within(double least, double most, Least bound) {
  const bool excluded = bound == Least::excluded;
  return {[=](std::string& text) {
            double value = 0;
            const bool good = io::parse_number(text, value) && std::isfinite(value) && value <= most &&
                              (excluded ? value > least : value >= least);
            if (good) return std::string();
            return io::in_quotes(text) + " is no number " + (excluded ? "above " : "from ") +
                   io::shortest_number(least) +
                   (most < 1e300 ? (excluded ? " and up to " : " to ") + io::shortest_number(most) : "");
          },
          "", "number"};
}

CLI::Validator one_of(std::vector<std::string> words) {
  return {[words](std::string& text) {
            if (std::find(words.begin(), words.end(), text) != words.end()) return std::string();
            return io::in_quotes(text) + " is not one of " + joined(words, ", ");
          },
          "", "choice"};
}

void add_output_options(CLI::App& command, OutputOptions& options) {
  command.add_flag("--json", options.json, "one JSON document on stdout, nothing else there");
  command.add_flag("--quiet,-q", options.quiet, "no progress, no summary, no warnings");
  command.add_flag("--verbose,-v", options.verbose, "say on stderr what was read and chosen");
  command.set_version_flag("--version", LICHTHOF_VERSION_LINE, "print the version and exit");
}

void add_scene_options(CLI::App& command, io::ReadOptions& options) {
  command
      .add_option("--unit", options.unit,
                  "unit of the scene's numbers: mm cm m in ft (default: what a scene file says, else m)")
      ->check(one_of({"mm", "cm", "m", "in", "ft"}))
      ->option_text("UNIT");
  command
      .add_option("--up", options.up,
                  "axis of the scene that points up: y or z (default: what a scene file says, else z)")
      ->check(one_of({"y", "z"}))
      ->option_text("AXIS");
}

void add_first_pass_options(CLI::App& command, FirstPassOptions& options) {
  const std::string group = "First pass";
  const auto add = [&](const std::string& name, auto& value, const std::string& text, const std::string& placeholder) {
    return command.add_option(name, value, text)->group(group)->option_text(placeholder);
  };
  add("--cells", options.cells, "subscenes: a count, or how many along x, y (and z): 8, 4x2, 4x2x2 (default 1)",
      "N|NxM[xK]")
      ->check(cells_text());
  add("--eps", options.eps,
      "stop when the largest unshot energy is below this share of the largest initial one (default 2e-3, where nothing "
      "hides anything 1e-5, method hemicube 5e-4)",
      "SHARE")
      ->check(number_within(0, 1, Least::excluded));
  add("--hemicube", options.hemicube, "pixels along the hemicube's top, even, 8 to 1024 (default 128)", "R")
      ->check(hemicube_text());
  add("--patch", options.patch, "size of a patch in scene units; patches shoot", "SIZE")
      ->check(number_within(0, 1e300, Least::excluded));
  add("--element", options.element,
      "size of an element in scene units; elements receive (default: a quarter of a patch)", "SIZE")
      ->check(number_within(0, 1e300, Least::excluded));
  add("--elements", options.elements, "choose the sizes so that about this many elements arise (default 12000)", "N")
      ->check(number_within(1, most_elements));
}

void add_threads_option(CLI::App& command, unsigned& threads) {
  command.add_option("--threads", threads, "threads to use (default: all)")
      ->check(number_within(1, 1024))
      ->option_text("N");
}

void add_exposure_option(CLI::App& command, std::optional<double>& exposure_ev, const std::string& what) {
  command
      .add_option("--exposure", exposure_ev,
                  "brightness of " + what + " in stops: radiance is multiplied by 2^EV (default: automatic)")
      ->check(number_within(-60, 60))
      ->option_text("EV");
}

bool read_size(const std::string& text, std::uint32_t& width, std::uint32_t& height) {
  const std::size_t cross = text.find_first_of("xX");
  std::int64_t across = 0, down = 0;
  if (cross == std::string::npos || !io::parse_integer(std::string_view(text).substr(0, cross), across) ||
      !io::parse_integer(std::string_view(text).substr(cross + 1), down))
    return false;
  if (across < 1 || down < 1 || across > longest_side || down > longest_side || across * down > most_pixels)
    return false;
  width = static_cast<std::uint32_t>(across);
  height = static_cast<std::uint32_t>(down);
  return true;
}

void add_size_option(CLI::App& command, std::string& text) {
  command.add_option("--size", text, "pixels (default 640x480)")
      ->check(CLI::Validator(
          [](std::string& given) {
            std::uint32_t width = 0, height = 0;
            return read_size(given, width, height)
                       ? std::string()
                       : io::in_quotes(given) + " is no size such as 640x480, at most 2^28 pixels";
          },
          "", "size"))
      ->option_text("WxH");
}

unsigned threads_to_use(unsigned asked) {
  return asked > 0 ? asked : std::max(1u, std::thread::hardware_concurrency());
}

void add_method_option(CLI::App& command, std::optional<std::string>& method, const std::vector<std::string>& names) {
  command.add_option("--method", method, joined(names, ", ") + " (default " + names.front() + ")")
      ->check(one_of(names))
      ->option_text("NAME");
}

Method method_named(const std::string& name) {
  const auto found =
      std::find_if(method_table.begin(), method_table.end(), [&](const auto& row) { return name == row.first; });
  MUST(found != method_table.end());
  return found->second;
}

const char* name_of(Method method) {
  const auto found =
      std::find_if(method_table.begin(), method_table.end(), [&](const auto& row) { return method == row.second; });
  MUST(found != method_table.end());
  return found->first;
}

}  // namespace lichthof::apps
