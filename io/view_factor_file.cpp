#include "io/view_factor_file.hpp"

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

Status write_csv(AtomicFile& file, const ViewFactors& factors, std::span<const std::string> names) {
  std::string line = "surface,area_m2";
  for (const std::string& name : names) line += "," + cell(name);
  Status written = file.append(line + "\n");
  for (std::size_t i = 0; i < factors.count && written; ++i) {
    line = cell(names[i]) + "," + number(factors.areas[i]);
    for (std::size_t j = 0; j < factors.count; ++j) line += "," + number(factors.factor(i, j));
    written = file.append(line + "\n");
  }
  return written;
}

/// `"key": [[...], ...]`, one line a row.
template <class Value>
Status append_matrix(AtomicFile& file, const char* key, std::size_t count, Value value) {
  Status written = file.append(std::string("\"") + key + "\": [");
  for (std::size_t i = 0; i < count && written; ++i) {
    std::string line = i == 0 ? "\n[" : ",\n[";
    for (std::size_t j = 0; j < count; ++j) line += (j == 0 ? "" : ",") + number(value(i, j));
    written = file.append(line + "]");
  }
  return written ? file.append("]") : written;
}

Status write_json(AtomicFile& file, const ViewFactors& factors, std::span<const std::string> names) {
  nlohmann::json surfaces = nlohmann::json::array();
  for (std::size_t i = 0; i < factors.count; ++i)
    surfaces.push_back({{"name", printable(names[i])}, {"area_m2", factors.areas[i]}, {"row_sum", factors.row_sum(i)}});
  if (Status written = file.append("{\"surfaces\": " + surfaces.dump() + ",\n"); !written) return written;
  const auto factor = [&](std::size_t i, std::size_t j) { return factors.factor(i, j); };
  if (Status written = append_matrix(file, "factors", factors.count, factor); !written) return written;
  if (Status written = file.append(",\n"); !written) return written;
  const auto error = [&](std::size_t i, std::size_t j) { return factors.error(i, j); };
  if (Status written = append_matrix(file, "errors", factors.count, error); !written) return written;
  return file.append("}\n");
}

}  // namespace

Status write_view_factors(const std::string& path, const ViewFactors& factors, std::span<const std::string> names) {
  MUST(names.size() == factors.count);
  const bool json = path.ends_with(".json");
  if (!json && !path.ends_with(".csv")) return bad_input(path, "a name that ends in .csv or .json was expected");
  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  const Status written = json ? write_json(*file, factors, names) : write_csv(*file, factors, names);
  return written ? file->commit() : written;
}

}  // namespace lichthof::io
