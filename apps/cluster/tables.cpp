#include "apps/cluster/tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/common/progress.hpp"
#include "io/text.hpp"

namespace lichthof::apps {

namespace {

constexpr std::size_t widest_column = 40;

std::string shown(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string percent(double share) { return shown("%.0f%%", 100 * std::clamp(share, 0.0, 1.0)); }

/// Number of characters, not bytes.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string cut(std::string text) {
  if (width(text) <= widest_column) return text;
  std::size_t at = 0;
  for (std::size_t left = widest_column - 3; left > 0; --left) do
      ++at;
    while ((static_cast<unsigned char>(text[at]) & 0xC0) == 0x80);
  return text.substr(0, at) + "...";
}

/// Rows of cells, the first being names; columns that begin with '>' stand on the right.
Lines aligned(std::vector<std::vector<std::string>> rows) {
  std::vector<bool> right;
  for (std::string& name : rows[0]) {
    right.push_back(name.starts_with('>'));
    if (right.back()) name.erase(0, 1);
  }
  std::vector<std::size_t> widths(right.size(), 0);
  for (std::vector<std::string>& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) {
      row[i] = cut(io::printable(row[i]));
      widths[i] = std::max(widths[i], width(row[i]));
    }
  Lines lines;
  for (const std::vector<std::string>& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string blanks(widths[i] - width(row[i]), ' ');
      line += (i ? "  " : "") + (right[i] ? blanks + row[i] : row[i] + blanks);
    }
    lines.push_back(line.substr(0, line.find_last_not_of(' ') + 1));
  }
  return lines;
}

/// "3 5 8"
std::string list_at(const nlohmann::json& document, const char* key) {
  std::string text;
  if (document.is_object() && document.contains(key) && document[key].is_array())
    for (const nlohmann::json& item : document[key])
      text += (text.empty() ? "" : " ") + (item.is_string() ? item.get<std::string>() : item.dump());
  return text;
}

Lines rows_or(const std::vector<std::vector<std::string>>& rows, const char* none) {
  return rows.size() > 1 ? aligned(rows) : Lines{none};
}

}  // namespace

std::string text_at(const nlohmann::json& document, const char* key) {
  if (!document.is_object() || !document.contains(key) || document[key].is_null()) return "";
  const nlohmann::json& value = document[key];
  return value.is_string() ? value.get<std::string>()
                           : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

double number_at(const nlohmann::json& document, const char* key) {
  if (!document.is_object() || !document.contains(key) || !document[key].is_number()) return 0;
  const double value = document[key].get<double>();
  return std::isfinite(value) ? value : 0;
}

std::string short_number(double value) {
  const char* units[] = {"", "k", "M", "G", "T", "P"};
  std::size_t unit = 0;
  while (std::abs(value) >= 999.5 && unit < 5) value /= 1000, ++unit;
  return shown(std::abs(value) >= 99.95 || (unit == 0 && value == std::floor(value)) ? "%.0f" : "%.3g", value) +
         units[unit];
}

std::string bytes_text(double bytes) { return short_number(bytes) + "B"; }

std::string bar(double share, std::size_t width) {
  const auto full = static_cast<std::size_t>(std::lround(std::clamp(share, 0.0, 1.0) * static_cast<double>(width)));
  return "[" + std::string(full, '#') + std::string(width - full, ' ') + "]";
}

Lines node_lines(const nlohmann::json& nodes) {
  std::vector<std::vector<std::string>> rows{
      {"NODE", "HOST", "STATE", ">CORES", ">BUSY", ">RAYS/S", ">FREE", ">IN", ">OUT", "JOBS"}};
  for (const nlohmann::json& node : nodes)
    rows.push_back({text_at(node, "name"), text_at(node, "host"), text_at(node, "state"), text_at(node, "cores"),
                    percent(number_at(node, "busy_share")), short_number(number_at(node, "rays_per_s")),
                    bytes_text(number_at(node, "free_memory_bytes")), bytes_text(number_at(node, "bytes_in")),
                    bytes_text(number_at(node, "bytes_out")), list_at(node, "jobs")});
  return rows_or(rows, "no node has joined");
}

Lines actor_lines(const nlohmann::json& actors) {
  std::vector<std::vector<std::string>> rows{{"NODE", "ACTOR", "KIND", ">JOB", "STATE", ">BUSY", ">MAILBOX", ">SHOTS/S",
                                              ">RAYS/S", ">UNSHOT W", ">IN", ">OUT", ">MEMORY"}};
  for (const nlohmann::json& actor : actors)
    rows.push_back({text_at(actor, "node"), text_at(actor, "actor"), text_at(actor, "kind"), text_at(actor, "job"),
                    text_at(actor, "state"), percent(number_at(actor, "busy_share")),
                    short_number(number_at(actor, "mailbox")), short_number(number_at(actor, "shots_per_s")),
                    short_number(number_at(actor, "rays_per_s")), shown("%.3g", number_at(actor, "unshot_w")),
                    bytes_text(number_at(actor, "bytes_in")), bytes_text(number_at(actor, "bytes_out")),
                    bytes_text(number_at(actor, "memory_bytes"))});
  return rows_or(rows, "no actor is at work");
}

Lines job_lines(const nlohmann::json& jobs) {
  std::vector<std::vector<std::string>> rows{{">ID", "STATE", ">DONE", "PASS", ">TIME", "OWNER", "TITLE", "REASON"}};
  for (const nlohmann::json& job : jobs)
    rows.push_back({text_at(job, "id"), text_at(job, "state"), percent(number_at(job, "progress")),
                    text_at(job, "pass"), duration_text(number_at(job, "seconds")), text_at(job, "owner"),
                    text_at(job, "title"), text_at(job, "reason")});
  return rows_or(rows, "no jobs");
}

Lines job_detail(const nlohmann::json& job) {
  Lines lines;
  if (!job.is_object()) return lines;
  for (const auto& [key, value] : job.items()) {
    std::string name = io::printable(key), text = io::printable(text_at(job, key.c_str()));
    name.resize(std::max<std::size_t>(14, name.size() + 1), ' ');
    lines.push_back(name + text);
  }
  return lines;
}

Lines method_lines(const nlohmann::json& methods) {
  Lines lines;
  for (const nlohmann::json& method : methods) {
    std::string name = method.is_string() ? method.get<std::string>() : text_at(method, "name");
    name = io::printable(name);
    name.resize(std::max<std::size_t>(14, name.size() + 1), ' ');
    lines.push_back(name + io::printable(text_at(method, "text")));
  }
  return lines;
}

}  // namespace lichthof::apps
