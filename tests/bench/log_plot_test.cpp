#include "bench/log_plot.hpp"

#include <doctest/doctest.h>

using namespace lichthof;
using namespace lichthof::bench;

namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// The numbers after `name="` at each of its places.
std::vector<double> attributes(const std::string& text, const std::string& name) {
  std::vector<double> values;
  const std::string start = " " + name + "=\"";
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1))
    values.push_back(std::stod(text.substr(at + start.size())));
  return values;
}

}  // namespace

TEST_SUITE("bench") {
  TEST_CASE("log_plot: equal ratios are equal distances, and more goes up and to the right") {
    Panel panel{"", {"time (s)"}, {"error", true}, {}};
    panel.curves.push_back({"some", "#000", Mark::circle, {{.01, .2}, {.1, .02}, {1, .002}}, {}});
    const std::string text = svg(std::vector<Panel>{panel}, "");
    const std::vector<double> x = attributes(text, "cx"), y = attributes(text, "cy");
    REQUIRE(x.size() == 4);  // and the one of the key
    CHECK(x[1] - x[0] > 50);
    CHECK(x[2] - x[1] == doctest::Approx(x[1] - x[0]).epsilon(1e-3));  // coordinates are written to a hundredth
    CHECK(y[1] - y[0] > 50);
    CHECK(y[2] - y[1] == doctest::Approx(y[1] - y[0]).epsilon(1e-3));
    for (const char* label : {">0.1<", ">1<", ">10 %<", ">1 %<", ">time (s)<", ">error<", ">some<"}) {
      INFO(label);
      CHECK(count_of(text, label) == 1);
    }
  }

  TEST_CASE("log_plot: names keep their signs, and every element is closed") {
    Panel panel{"a < b & c", {"x"}, {"y"}, {}};
    panel.curves.push_back({"one", "#000", Mark::diamond, {{1, 1}}, {{1, 1}}});  // a single value is a plot too
    const std::string text = svg(std::vector<Panel>{panel, panel}, "caption");
    CHECK(count_of(text, ">a &lt; b &amp; c</text>") == 2);
    CHECK(count_of(text, "<g ") == count_of(text, "</g>"));
    CHECK(count_of(text, "<text ") == count_of(text, "</text>"));
    CHECK(count_of(text, "<path ") + count_of(text, "<circle ") + count_of(text, "<rect ") == count_of(text, "/>"));
    CHECK(text.find("nan") == std::string::npos);
    CHECK(text.find("inf") == std::string::npos);
  }
}
