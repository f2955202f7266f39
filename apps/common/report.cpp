#include "apps/common/report.hpp"

#include <sys/resource.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "core/light/kernels/kernels.hpp"

namespace lichthof::apps {

namespace {

std::string shown(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// "12.34 %"; what rounds to nothing has no sign.
std::string percent(double part, double whole) {
  const double hundredths = whole > 0 ? std::round(1e4 * part / whole) : 0;
  return shown("%.2f %%", hundredths == 0 ? 0 : hundredths / 100);
}

std::uint64_t cell_count(const RunRecord& record) {
  return std::uint64_t{record.cells[0]} * record.cells[1] * record.cells[2];
}

nlohmann::json energy_json(const RunRecord& record) {
  // Without a first pass nobody has kept the ledger.
  if (!record.has_first_pass)
    return {{"emitted", record.emitted_w},
            {"absorbed", nullptr},
            {"escaped", nullptr},
            {"unshot", nullptr},
            {"residual", nullptr}};
  const EnergyLedger& energy = record.energy;
  return {{"emitted", energy.emitted},
          {"absorbed", energy.absorbed},
          {"escaped", energy.escaped},
          {"unshot", energy.unshot},
          {"residual", energy.residual()},
          {"gain_direct", energy.gain_direct},
          {"gain_indirect", energy.gain_indirect}};
}

double per(std::uint64_t bytes, std::uint64_t count) {
  return count > 0 ? static_cast<double>(bytes) / static_cast<double>(count) : 0;
}

nlohmann::json counters_json(const RunRecord& record) {
  const SolveCounters& counters = record.counters;
  return {{"form_factors", counters.form_factors},       {"rays_saved", counters.rays_saved},
          {"rays_remembered", counters.rays_remembered}, {"messages", counters.messages},
          {"bytes_per_shot", per(counters.bytes_sent, counters.shots)},
          {"bytes_per_message", per(counters.bytes_sent, counters.messages)},
          {"bitmap_bytes", counters.bitmap_bytes},       {"bitmap_bytes_raw", counters.bitmap_bytes_raw},
          {"cells_skipped", counters.cells_skipped},     {"clusters_tested", counters.clusters_tested},
          {"clusters_behind", counters.clusters_behind},
          {"clusters_hidden", counters.clusters_hidden}, {"clusters_cut", counters.clusters_cut},
          {"sides_dark", record.sides_dark}};
}

}  // namespace

nlohmann::json json(const RunRecord& record) {
  const RunRecord::Seconds& s = record.seconds;
  nlohmann::json document = {
      {"command", record.command},
      {"version", LICHTHOF_VERSION},
      {"input", record.input},
      {"output", record.output},
      {"method", record.method},
      {"elements", record.elements},
      {"patches", record.patches},
      {"cells", cell_count(record)},
      {"cell_grid", record.cells},
      {"nodes", 1},
      {"threads", record.threads},
      {"vector", kernels().name},
      {"shots", record.counters.shots},
      {"rays", record.counters.rays + record.traced_rays},
      {"seconds",
       {{"load", s.load}, {"mesh", s.mesh}, {"radiosity", s.radiosity}, {"check", s.check}, {"rays", s.rays}, {"total", s.total}}},
      {"energy", energy_json(record)},
      {"error_estimate", nullptr},
      {"bytes_sent", record.counters.bytes_sent},
      {"peak_memory_bytes", peak_memory_bytes()},
      {"converged", record.has_first_pass ? nlohmann::json(record.converged) : nlohmann::json(nullptr)},
      {"counters", counters_json(record)},
      {"solution", record.kept_solution.empty() ? nlohmann::json(nullptr) : nlohmann::json(record.kept_solution)},
      {"import", record.import ? record.import->json() : nlohmann::json(nullptr)},
  };
  document.update(record.more);
  return document;
}

std::vector<std::string> summary(const RunRecord& record, const std::string& done) {
  std::vector<std::string> lines{done};
  if (record.has_first_pass) {
    lines.push_back(
        grouped(record.elements) + " elements in " + grouped(record.patches) + " patches, " +
        grouped(cell_count(record)) + (cell_count(record) == 1 ? " cell, " : " cells, ") +
        grouped(record.counters.shots) + " shots, " + grouped(record.counters.rays + record.traced_rays) + " rays" +
        (record.counters.bytes_sent > 0
             ? ", " + grouped(record.counters.bytes_sent) + " bytes between cells" +
                   shown(" (%.0f per shot,", per(record.counters.bytes_sent, record.counters.shots)) +
                   shown(" %.0f per message)", per(record.counters.bytes_sent, record.counters.messages))
             : ""));
    const EnergyLedger& energy = record.energy;
    lines.push_back("energy: " + shown("%.4g W emitted = ", energy.emitted) + percent(energy.absorbed, energy.emitted) +
                    " absorbed + " + percent(energy.escaped, energy.emitted) + " escaped + " +
                    percent(energy.unshot, energy.emitted) + " unshot, " + shown("residual %.1e", energy.residual()));
  } else {
    lines.push_back(grouped(record.traced_rays) + " rays");
  }
  lines.insert(lines.end(), record.lines.begin(), record.lines.end());
  const RunRecord::Seconds& s = record.seconds;
  lines.push_back(shown("%.2f s", s.total) + shown(" (load %.2f,", s.load) + shown(" mesh %.2f,", s.mesh) +
                  shown(" radiosity %.2f,", s.radiosity) + (s.check > 0 ? shown(" check %.2f,", s.check) : "") +
                  shown(" rays %.2f)", s.rays) + " on " +
                  std::to_string(record.threads) + (record.threads == 1 ? " thread" : " threads") +
                  shown(", %.0f MB", static_cast<double>(peak_memory_bytes()) / 1e6));
  return lines;
}

Status print(const OutputOptions& options, const nlohmann::json& document, const std::vector<std::string>& lines) {
  std::string text;
  if (options.json)
    // Names of files may be in any encoding; JSON is UTF-8.
    text = document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  else if (!options.quiet)
    for (const std::string& line : lines) text += line + "\n";
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    return Error{ErrorCode::io, "stdout", std::string("cannot be written: ") + std::strerror(errno)};
  return Done{};
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ' ');
  return text;
}

}  // namespace lichthof::apps
