#include "bench/log_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/check.hpp"

namespace lichthof::bench {

namespace {

// Sizes in px.
constexpr double panel_width = 430, panel_height = 440, caption_height = 26;
constexpr double left = 66, right = 14, top = 34, bottom = 56;
constexpr double key_step = 20, key_width = 108, mark_size = 4.2;
constexpr const char* ink = "#24292f";
constexpr const char* faint = "#d9dee3";

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Two decimals are a hundredth of a pixel.
std::string px(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return safe;
}

std::string text_at(double x, double y, const std::string& text, const std::string& more) {
  return "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" " + more + ">" + escaped(text) + "</text>\n";
}

std::string line_between(double x0, double y0, double x1, double y1, const char* colour) {
  return "<path d=\"M" + px(x0) + " " + px(y0) + "L" + px(x1) + " " + px(y1) + "\" stroke=\"" + colour + "\"/>\n";
}

/// One axis of a panel: from values to pixels.
class Scale {
 public:
  Scale(double least, double most, double from_px, double to_px)
      : low_(std::log10(least) - margin), high_(std::log10(most) + margin), from_(from_px), to_(to_px) {}

  double at(double value) const { return from_ + (to_ - from_) * (std::log10(value) - low_) / (high_ - low_); }

  struct Tick {
    double value;
    bool labelled;
  };
  /// Powers of ten with their multiples by 2 and 5; only so many have a label that labels don't run into each other.
  std::vector<Tick> ticks() const {
    const double decades = high_ - low_;
    std::vector<Tick> all;
    for (int power = static_cast<int>(std::floor(low_)); power <= static_cast<int>(std::ceil(high_)); ++power)
      for (const double factor : {1.0, 2.0, 5.0}) {
        const double value = factor * std::pow(10.0, power), place = std::log10(value);
        if (place >= low_ && place <= high_) all.push_back({value, factor == 1 || decades < 2.6});
      }
    return all;
  }

 private:
  static constexpr double margin = 0.08;  // decades beyond the outermost points
  double low_, high_, from_, to_;
};

std::string mark_at(Mark mark, double x, double y, const std::string& colour) {
  const double r = mark_size;
  const std::string paint = " fill=\"" + colour + "\" stroke=\"white\" stroke-width=\"0.8\"/>\n";
  const auto shape = [&](std::initializer_list<std::array<double, 2>> corners) {
    std::string path;
    for (const auto& corner : corners)
      path += (path.empty() ? "M" : "L") + px(x + r * corner[0]) + " " + px(y + r * corner[1]);
    return "<path d=\"" + path + "Z\"" + paint;
  };
  switch (mark) {
    case Mark::circle:
      return "<circle cx=\"" + px(x) + "\" cy=\"" + px(y) + "\" r=\"" + px(r) + "\"" + paint;
    case Mark::square:
      return shape({{-.9, -.9}, {.9, -.9}, {.9, .9}, {-.9, .9}});
    case Mark::triangle:
      return shape({{0, -1.2}, {1.15, .85}, {-1.15, .85}});
    case Mark::diamond:
      return shape({{0, -1.3}, {1.3, 0}, {0, 1.3}, {-1.3, 0}});
    case Mark::none:
      break;
  }
  return "";
}

std::string stroke_of(const Curve& curve) {
  return "fill=\"none\" stroke=\"" + curve.colour + "\" stroke-width=\"" + px(curve.line_width) +
         "\" stroke-linejoin=\"round\" stroke-linecap=\"round\"/>\n";
}

std::string drawn(const Curve& curve, const Scale& x, const Scale& y) {
  std::string text, path;
  for (const Vec2& p : curve.line) path += (path.empty() ? "M" : "L") + px(x.at(p.x)) + " " + px(y.at(p.y));
  if (!path.empty()) text += "<path d=\"" + path + "\" " + stroke_of(curve);
  for (const Vec2& p : curve.points) text += mark_at(curve.mark, x.at(p.x), y.at(p.y), curve.colour);
  return text;
}

std::string key_of(const Panel& panel) {
  const double x = panel.key == Panel::Key::upper_left ? left + 12 : panel_width - right - key_width;
  double y = top + 14;
  std::string text;
  for (const Curve& curve : panel.curves) {
    text += "<path d=\"M" + px(x) + " " + px(y) + "H" + px(x + 26) + "\" " + stroke_of(curve);
    text += mark_at(curve.mark, x + 13, y, curve.colour);
    text += text_at(x + 34, y + 4.5, curve.name, "class=\"halo\"");
    y += key_step;
  }
  return text;
}

std::string tick_text(double value, const Axis& axis) {
  if (axis.shows_percent) return number(100 * value) + " %";
  return value >= 10000 ? number(value / 1000) + "k" : number(value);
}

std::string drawn(const Panel& panel) {
  Vec2 least{1e300}, most{0.0};
  for (const Curve& curve : panel.curves)
    for (const Vec2& p : curve.points) {
      MUST(p.x > 0 && p.y > 0);
      least = glm::min(least, p), most = glm::max(most, p);
    }
  MUST(most.x > 0);
  const double x0 = left, x1 = panel_width - right, y0 = panel_height - bottom, y1 = top;
  const Scale x(least.x, most.x, x0, x1), y(least.y, most.y, y0, y1);
  std::string text = text_at(x0, top - 12, panel.title, "font-weight=\"bold\"");
  for (const auto& tick : x.ticks()) {
    text += line_between(x.at(tick.value), y0, x.at(tick.value), y1, faint);
    if (tick.labelled)
      text += text_at(x.at(tick.value), y0 + 19, tick_text(tick.value, panel.x), "text-anchor=\"middle\"");
  }
  for (const auto& tick : y.ticks()) {
    text += line_between(x0, y.at(tick.value), x1, y.at(tick.value), faint);
    if (tick.labelled)
      text += text_at(x0 - 7, y.at(tick.value) + 4.5, tick_text(tick.value, panel.y), "text-anchor=\"end\"");
  }
  text += line_between(x0, y0, x1, y0, ink) + line_between(x0, y0, x0, y1, ink);
  text += text_at((x0 + x1) / 2, panel_height - 14, panel.x.text, "text-anchor=\"middle\"");
  text += text_at(0, 0, panel.y.text,
                  "text-anchor=\"middle\" transform=\"translate(15 " + px((y0 + y1) / 2) + ") rotate(-90)\"");
  for (const Curve& curve : panel.curves) text += drawn(curve, x, y);
  return text + key_of(panel);
}

}  // namespace

std::string svg(std::span<const Panel> panels, const std::string& caption) {
  const double width = panel_width * static_cast<double>(panels.size()), height = panel_height + caption_height;
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + px(width) + "\" height=\"" + px(height) +
                     "\" viewBox=\"0 0 " + px(width) + " " + px(height) +
                     "\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"14\" fill=\"" + ink +
                     "\">\n<style>.halo { paint-order: stroke; stroke: white; stroke-width: 4px }</style>\n"
                     "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (std::size_t k = 0; k < panels.size(); ++k)
    text += "<g transform=\"translate(" + px(panel_width * static_cast<double>(k)) + " 0)\">\n" + drawn(panels[k]) +
            "</g>\n";
  return text + text_at(left, panel_height + 8, caption, "font-size=\"12\" fill=\"#57606a\"") + "</svg>\n";
}

}  // namespace lichthof::bench
