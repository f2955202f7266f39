/// What a run reports when it is over: the JSON of the contract, or some lines for people.
#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/options.hpp"
#include "core/light/solution.hpp"
#include "io/import_report.hpp"

namespace lichthof::apps {

/// Seconds of wall clock since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// One run of `render`, `solve` or `probe`, filled in as it proceeds.
struct RunRecord {
  std::string command, input, output;
  std::string method;
  std::optional<io::ImportReport> import;  ///< not for solutions
  std::string kept_solution;               ///< file name; empty: none was asked for
  unsigned threads = 1;

  bool has_first_pass = false;  ///< the next six mean something
  std::uint64_t elements = 0, patches = 0;
  std::array<std::uint32_t, 3> cells{0, 0, 0};
  EnergyLedger energy;
  std::uint64_t sides_dark = 0;  ///< of surfaces: no light reaches them, and they get no patches or dormant ones
  SolveCounters counters;
  bool converged = false;
  double emitted_w = 0;  ///< of the scene, first pass or not

  std::uint64_t traced_rays = 0;  ///< of the second pass, or at sensor points
  struct Seconds {
    double load = 0, mesh = 0, radiosity = 0, check = 0, rays = 0, total = 0;
  } seconds;
  nlohmann::json more = nlohmann::json::object();  ///< what only this command knows
  std::vector<std::string> lines;                  ///< and that in words
};

/// The document that --json prints.
nlohmann::json json(const RunRecord& record);
/// The same in a few lines. @param done  first line: "room.png: 640 x 480"
std::vector<std::string> summary(const RunRecord& record, const std::string& done);

/// Prints one or the other on stdout, as asked. @error io when stdout takes nothing (a full disk)
Status print(const OutputOptions& options, const nlohmann::json& document, const std::vector<std::string>& lines);

/// Largest memory this process has had (bytes).
std::uint64_t peak_memory_bytes();

/// "12 345 678".
std::string grouped(std::uint64_t number);

}  // namespace lichthof::apps
