/// Figures with names, units and goals, and how they are shown: the table and the JSON of `lichthof bench`.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace lichthof::bench {

/// What a figure should come to. Goals are ratios of one run, so they hold on any machine.
struct Goal {
  enum class Bound { least, most } bound = Bound::least;
  double value = 0;
  bool met(double figure) const { return bound == Bound::least ? figure >= value : figure <= value; }
};
inline Goal at_least(double value) { return {Goal::Bound::least, value}; }
inline Goal at_most(double value) { return {Goal::Bound::most, value}; }

struct Figure {
  std::string key;   ///< place in the JSON of the section: "ratio", or "avx2/pairs_per_s" for one level more
  std::string text;  ///< what it is, for people
  double value = 0;
  std::string unit;  ///< "ns", "1/s"; empty: a ratio or a number
  std::optional<Goal> goal;
};

struct Section {
  std::string name;
  std::vector<Figure> figures;
  /// Adds a figure.
  void add(std::string key, std::string text, double value, std::string unit = "", std::optional<Goal> goal = {}) {
    figures.push_back({std::move(key), std::move(text), value, std::move(unit), goal});
  }
};

/// {key: value, ..., "goals": {key: {"least" or "most": value, "met": true}}}
nlohmann::json json(const Section& section);
/// One line per figure: text, value with unit, and the goal with its outcome.
std::vector<std::string> lines(const Section& section);

}  // namespace lichthof::bench
