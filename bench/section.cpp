#include "bench/section.hpp"

#include <cmath>
#include <cstdio>

namespace lichthof::bench {

namespace {

/// Four digits, with a prefix of thousands where there is a unit to put it before.
std::string shown(double value, const std::string& unit) {
  char text[64];
  if (unit == "1/s" && value >= 1e6)
    std::snprintf(text, sizeof text, "%.4g M/s", value / 1e6);
  else if (value == std::floor(value) && std::abs(value) < 1e15)
    std::snprintf(text, sizeof text, "%.0f%s%s", value, unit.empty() ? "" : " ", unit.c_str());
  else
    std::snprintf(text, sizeof text, "%.4g%s%s", value, unit.empty() ? "" : " ", unit.c_str());
  return text;
}

/// The value at a key with slashes. Not a JSON pointer: that makes an array of a scene named 0.
nlohmann::json& place(nlohmann::json& document, const std::string& key) {
  const std::size_t slash = key.find('/');
  nlohmann::json& value = document[key.substr(0, slash)];
  return slash == std::string::npos ? value : place(value, key.substr(slash + 1));
}

}  // namespace

nlohmann::json json(const Section& section) {
  nlohmann::json document = nlohmann::json::object();
  nlohmann::json goals = nlohmann::json::object();
  for (const Figure& figure : section.figures) {
    place(document, figure.key) = figure.value;
    if (!figure.goal) continue;
    const char* bound = figure.goal->bound == Goal::Bound::least ? "least" : "most";
    goals[figure.key] = {{bound, figure.goal->value}, {"met", figure.goal->met(figure.value)}};
  }
  document["goals"] = std::move(goals);
  return document;
}

std::vector<std::string> lines(const Section& section) {
  std::vector<std::string> all{section.name};
  for (const Figure& figure : section.figures) {
    char line[200];
    std::snprintf(line, sizeof line, "  %-62s %16s", figure.text.c_str(), shown(figure.value, figure.unit).c_str());
    all.emplace_back(line);
    if (!figure.goal) continue;
    const char* bound = figure.goal->bound == Goal::Bound::least ? "at least" : "at most";
    std::snprintf(line, sizeof line, "   goal: %s %.3g, %s", bound, figure.goal->value,
                  figure.goal->met(figure.value) ? "met" : "missed");
    all.back() += line;
  }
  return all;
}

}  // namespace lichthof::bench
