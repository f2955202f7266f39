/// Plots with two logarithmic axes, as SVG: panels in a row, each with its own axes, curves of marked points, and a key.
/// This file knows how such a plot looks; what it shows is the caller's.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/types.hpp"

namespace lichthof::bench {

enum class Mark { circle, square, triangle, diamond, none };

struct Curve {
  std::string name;    ///< in the key
  std::string colour;  ///< as SVG has it: "#0072b2"
  Mark mark = Mark::circle;
  std::vector<Vec2> points;  ///< marked; coordinates above 0
  std::vector<Vec2> line;    ///< joined, in this order; may be empty
  double line_width = 1.8;   ///< px
};

struct Axis {
  std::string text;            ///< with its unit
  bool shows_percent = false;  ///< 0.05 reads "5 %"
};

struct Panel {
  std::string title;
  Axis x, y;
  std::vector<Curve> curves;                                          ///< drawn in this order
  enum class Key { upper_right, upper_left } key = Key::upper_right;  ///< where the plot leaves room for it
};

/// @param caption  one line under all panels
/// @pre every panel has a point
std::string svg(std::span<const Panel> panels, const std::string& caption);

}  // namespace lichthof::bench
