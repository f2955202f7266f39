#include "io/view_factor_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

/// Ten digits: more than any factor has.
std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

/// A cell of a CSV file: in quotes where it holds what would end it.
std::string cell(const std::string& name) {
  const std::string text = printable(name);
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// In JSON and CSV.
std::string known(double value, const char* unknown) { return std::isnan(value) ? unknown : number(value); }

struct Table {
  const ViewFactors& factors;
  std::span<const std::string> names;
  const ViewFactorRecord& record;
  std::vector<std::uint32_t> rows;
  std::string remarks() const {
    std::string lines;
    for (const std::string& fault : faults(factors, record.tolerance, names)) lines += "# " + fault + "\n";
    return lines;
  }
};

Status write_csv(AtomicFile& file, const Table& table) {
  std::string line = "surface,area_m2";
  for (const std::string& name : table.names) line += "," + cell(name);
  Status written = file.append(line + "\n");
  for (const std::uint32_t i : table.rows) {
    line = cell(table.names[i]) + "," + number(table.factors.areas[i]);
    for (std::size_t j = 0; j < table.factors.count; ++j) line += "," + known(table.factors.factor(i, j), "");
    if (written) written = file.append(line + "\n");
  }
  return written ? file.append(table.remarks()) : written;
}

Status write_view3d(AtomicFile& file, const Table& table) {
  const std::size_t count = table.factors.count;
  const auto line = [&](const char* format, auto value) {
    std::string text;
    for (std::size_t j = 0; j < count; ++j) {
      char digits[32];
      std::snprintf(digits, sizeof digits, format, value(j));
      text += (j == 0 ? "" : " ") + std::string(digits);
    }
    return text + "\n";
  };
  // View3D's header is 30 characters long, blanks included.
  std::string header = "View3D 3.2 0 0 0 " + std::to_string(count);
  header.resize(std::max<std::size_t>(header.size(), 30), ' ');
  Status written = file.append(header + "\n" + line("%.9g", [&](std::size_t j) { return table.factors.areas[j]; }));
  for (std::size_t i = 0; i < count && written; ++i)
    written = file.append(line("%.9f", [&](std::size_t j) { return table.factors.factor(i, j); }));
  const std::vector<double>& emittances = table.record.emittances;
  if (written)
    written = file.append(line("%.3f", [&](std::size_t j) { return emittances.empty() ? 1.0 : emittances[j]; }));
  return written ? file.append(table.remarks()) : written;
}

/// `"key": [[...], ...]`, one line a row.
template <class Value>
Status append_matrix(AtomicFile& file, const char* key, const Table& table, Value value) {
  Status written = file.append(std::string("\"") + key + "\": [");
  bool first = true;
  for (const std::uint32_t i : table.rows) {
    std::string line = first ? "\n[" : ",\n[";
    first = false;
    for (std::size_t j = 0; j < table.factors.count; ++j) line += (j == 0 ? "" : ",") + known(value(i, j), "null");
    if (written) written = file.append(line + "]");
  }
  return written ? file.append("]") : written;
}

Status write_json(AtomicFile& file, const Table& table) {
  const ViewFactors& factors = table.factors;
  const nlohmann::json about{{"complete", factors.pairs_missing == 0},
                             {"tolerance", table.record.tolerance},
                             {"pairs",
                              {{"inexact", factors.pairs_inexact},
                               {"disagreeing", factors.pairs_disagreeing},
                               {"missing", factors.pairs_missing}}}};
  std::string text = about.dump();
  text.pop_back();
  nlohmann::json surfaces = nlohmann::json::array(), columns = nlohmann::json::array();
  for (const std::uint32_t i : table.rows)
    surfaces.push_back(
        {{"name", printable(table.names[i])}, {"area_m2", factors.areas[i]}, {"row_sum", factors.row_sum(i)}});
  if (table.rows.size() < factors.count) {
    for (const std::string& name : table.names) columns.push_back(printable(name));
    text += ",\n\"columns\": " + columns.dump();
  }
  if (Status written = file.append(text + ",\n\"surfaces\": " + surfaces.dump() + ",\n"); !written) return written;
  const auto factor = [&](std::size_t i, std::size_t j) { return factors.factor(i, j); };
  if (Status written = append_matrix(file, "factors", table, factor); !written) return written;
  if (Status written = file.append(",\n"); !written) return written;
  const auto error = [&](std::size_t i, std::size_t j) { return factors.error(i, j); };
  if (Status written = append_matrix(file, "errors", table, error); !written) return written;
  return file.append("}\n");
}

}  // namespace

std::vector<std::string> faults(const ViewFactors& factors, double tolerance, std::span<const std::string> names) {
  std::vector<std::string> lines;
  if (factors.pairs_missing > 0)
    lines.push_back("incomplete: " + std::to_string(factors.pairs_missing) +
                    " pairs of surfaces were not reached before the run was stopped");
  if (factors.pairs_inexact > 0) {
    std::size_t row = 0, column = 0;
    for (std::size_t i = 0; i < factors.count; ++i)
      for (std::size_t j = 0; j < factors.count; ++j)
        if (factors.error(i, j) > factors.error(row, column)) row = i, column = j;
    lines.push_back(std::to_string(factors.pairs_inexact) + " pairs of surfaces missed the tolerance " +
                    shortest_number(tolerance) + "; the largest error estimate is " +
                    number(factors.error(row, column)) + ", from " + names[row] + " to " + names[column]);
  }
  if (factors.pairs_disagreeing > 0)
    lines.push_back(std::to_string(factors.pairs_disagreeing) +
                    " pairs of surfaces differ when computed the other way round by more than their estimates; their "
                    "estimates have the difference");
  return lines;
}

Status write_view_factors(const std::string& path, const ViewFactors& factors, std::span<const std::string> names,
                          const ViewFactorRecord& record) {
  MUST(names.size() == factors.count);
  const bool json = path.ends_with(".json"), view3d = path.ends_with(".vf");
  if (!json && !view3d && !path.ends_with(".csv"))
    return bad_input(path, "a name that ends in .vf, .csv or .json was expected");
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  Table table{factors, names, record, record.rows};
  if (table.rows.empty())
    for (std::uint32_t i = 0; i < factors.count; ++i) table.rows.push_back(i);
  const Status written = json     ? write_json(*file, table)
                         : view3d ? write_view3d(*file, table)
                                  : write_csv(*file, table);
  return written ? file->commit() : written;
}

}  // namespace lichthof::io
