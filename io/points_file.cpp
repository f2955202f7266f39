#include "io/points_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string_view>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::uint64_t largest_file = 2ull << 30;
constexpr double lumens_per_watt = 179;
constexpr std::array<std::string_view, 6> column_names = {"x", "y", "z", "nx", "ny", "nz"};
constexpr std::array<std::string_view, 3> irradiance_names = {"Er", "Eg", "Eb"}, error_names = {"Sr", "Sg", "Sb"};

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

/// Where three columns stand in a header. @returns none unless all of them are there
std::optional<std::array<std::size_t, 3>> triple_of(std::string_view header,
                                                    const std::array<std::string_view, 3>& names) {
  const std::vector<std::string_view> cells = cells_of(header);
  std::array<std::size_t, 3> columns{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto cell = std::find(cells.begin(), cells.end(), names[i]);
    if (cell == cells.end()) return std::nullopt;
    columns[i] = static_cast<std::size_t>(cell - cells.begin());
  }
  return columns;
}

/// @returns false unless three numbers ≥ 0 stand there
bool read_triple(std::string_view row, const std::array<std::size_t, 3>& columns, Rgb& value) {
  const std::vector<std::string_view> cells = cells_of(row);
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = columns[static_cast<std::size_t>(i)];
    if (at >= cells.size() || !parse_number(cells[at], value[i]) || !std::isfinite(value[i]) || value[i] < 0)
      return false;
  }
  return true;
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

Expected<PointEstimates> read_estimates(const std::string& path, const FileFrame& frame) {
  const Expected<SensorPoints> points = read_points(path, frame);
  if (!points) return points.error();
  const auto means = triple_of(points->header, irradiance_names), errors = triple_of(points->header, error_names);
  if (!means) return bad_input(path, "the header has no columns Er,Eg,Eb: irradiance at the points was expected");
  if (points->rows.empty()) return bad_input(path, "has no rows; points with their irradiance were expected");
  PointEstimates estimates;
  for (std::size_t i = 0; i < points->rows.size(); ++i) {
    Estimate estimate;
    if (!read_triple(points->rows[i], *means, estimate.mean) ||
        (errors && !read_triple(points->rows[i], *errors, estimate.standard_error)))
      return bad_input(path, "row " + std::to_string(i + 1) +
                                 ": irradiance and its standard error are numbers from 0, found " +
                                 in_quotes(points->rows[i]));
    estimates.points.push_back({points->positions[i], points->normals[i]});
    estimates.irradiance.push_back(estimate);
  }
  return estimates;
}

Status write_estimates(const std::string& path, const PointEstimates& estimates, const FileFrame& frame) {
  MUST(estimates.points.size() == estimates.irradiance.size());
  FileFrame turned = frame;
  turned.metres_per_unit = 1;
  SensorPoints points;
  points.header = "x,y,z,nx,ny,nz";
  for (const SensorPoint& sensor : estimates.points) {
    const Vec3 p = frame.point_to_file(sensor.point), n = turned.point_to_file(sensor.normal);
    char text[160];
    std::snprintf(text, sizeof text, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", p.x, p.y, p.z, n.x, n.y, n.z);
    points.rows.emplace_back(text);
  }
  return write_columns(path, points, "Er,Eg,Eb,Sr,Sg,Sb", [&](std::size_t i) {
    const Rgb &e = estimates.irradiance[i].mean, &s = estimates.irradiance[i].standard_error;
    char text[160];
    std::snprintf(text, sizeof text, ",%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", e.x, e.y, e.z, s.x, s.y, s.z);
    return std::string(text);
  });
}

}  // namespace lichthof::io
