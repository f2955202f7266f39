#include "io/points_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string_view>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t largest_file = 2ull << 30;
constexpr double lumens_per_watt = 179;
constexpr std::array<std::string_view, 6> column_names = {"x", "y", "z", "nx", "ny", "nz"};

/// Cells of a row, without the blanks and quotes around them. No cell of ours holds a comma.
std::vector<std::string_view> cells_of(std::string_view row) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t comma = row.find(',');
    std::string_view cell = trimmed(row.substr(0, comma));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
    cells.push_back(cell);
    if (comma == std::string_view::npos) return cells;
    row.remove_prefix(comma + 1);
  }
}

Expected<std::array<std::size_t, 6>> columns_of(const std::string& path, std::uint32_t line, std::string_view header) {
  const std::vector<std::string_view> cells = cells_of(header);
  std::array<std::size_t, 6> columns{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto cell = std::find(cells.begin(), cells.end(), column_names[i]);
    if (cell == cells.end())
      return bad_input(at_line(path, line), "the header has no column '" + std::string(column_names[i]) +
                                                "'; x,y,z,nx,ny,nz were expected, found " + in_quotes(header));
    columns[i] = static_cast<std::size_t>(cell - cells.begin());
  }
  return columns;
}

Status write_columns(const std::string& path, const SensorPoints& points, const char* names,
                     const std::function<std::string(std::size_t)>& cells) {
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  Status written = file->append(points.header + "," + names + "\n");
  for (std::size_t i = 0; i < points.rows.size() && written; ++i)
    written = file->append(points.rows[i] + cells(i) + "\n");
  return written ? file->commit() : written;
}

}  // namespace

Expected<SensorPoints> read_points(const std::string& path, const FileFrame& frame) {
  Expected<std::string> text = file_text(path, largest_file);
  if (!text) return text.error();
  Lines lines(std::move(*text));
  do {
    if (!lines.next()) return bad_input(path, "is empty; a header line x,y,z,nx,ny,nz was expected");
  } while (lines.line().empty());
  SensorPoints points;
  points.header = std::string(lines.line());
  const Expected<std::array<std::size_t, 6>> columns = columns_of(path, lines.number(), points.header);
  if (!columns) return columns.error();
  const std::size_t least_cells = 1 + *std::max_element((*columns).begin(), (*columns).end());

  while (lines.next()) {
    if (lines.line().empty()) continue;
    const std::string where = at_line(path, lines.number());
    const std::vector<std::string_view> cells = cells_of(lines.line());
    if (cells.size() < least_cells)
      return bad_input(where, "has " + std::to_string(cells.size()) + " cells; the header asks for at least " +
                                  std::to_string(least_cells));
    double v[6];
    for (std::size_t i = 0; i < 6; ++i) {
      const std::string_view cell = cells[(*columns)[i]];
      if (!parse_number(cell, v[i]) || !std::isfinite(v[i]) || std::abs(v[i]) > 1e9)
        return bad_input(where, std::string(column_names[i]) + " is no number within 1e9: " + in_quotes(cell));
    }
    const Vec3 normal = frame.direction_to_world({v[3], v[4], v[5]});
    const double length = glm::length(normal);
    if (!(length > 1e-12)) return bad_input(where, "the normal has no length");
    points.rows.emplace_back(lines.line());
    points.positions.push_back(frame.point_to_world({v[0], v[1], v[2]}));
    points.normals.push_back(normal / length);
  }
  return points;
}

Status write_irradiance(const std::string& path, const SensorPoints& points, std::span<const Rgb> irradiance) {
  MUST(irradiance.size() == points.rows.size());
  return write_columns(path, points, "Er,Eg,Eb", [irradiance](std::size_t i) {
    char text[96];
    std::snprintf(text, sizeof text, ",%.9g,%.9g,%.9g", irradiance[i].x, irradiance[i].y, irradiance[i].z);
    return std::string(text);
  });
}

Status write_illuminance(const std::string& path, const SensorPoints& points, std::span<const Rgb> irradiance) {
  MUST(irradiance.size() == points.rows.size());
  return write_columns(path, points, "lux", [irradiance](std::size_t i) {
    char text[48];
    std::snprintf(text, sizeof text, ",%.9g", lumens_per_watt * luminance(irradiance[i]));
    return std::string(text);
  });
}

}  // namespace lichthof::io
