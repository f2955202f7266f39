#include "core/cluster/termination.hpp"

#include <algorithm>

namespace lichthof {

bool Termination::file(const CellReport& report) {
  if (report.cell.value >= cells_ || report.wave > wave_) return false;
  auto& latest = latest_[report.cell.value];
  if (latest &&
      (report.messages_sent < latest->messages_sent || report.messages_processed < latest->messages_processed))
    return false;
  latest = report;
  if (!wave_under_way_ || report.wave != wave_) return true;

  auto& answer = answers_[report.cell.value];
  if (answer) return false;  // a cell answers a wave once
  answer = Counts{report.messages_sent, report.messages_processed, report.shots};
  answers_are_quiet_ = answers_are_quiet_ && report.idle;
  if (std::all_of(answers_.begin(), answers_.end(), [](const auto& a) { return a.has_value(); })) finish_wave();
  return true;
}

void Termination::finish_wave() {
  wave_under_way_ = false;
  std::vector<Counts> counts;
  std::uint64_t sent = 0, processed = 0;
  for (const auto& answer : answers_) {
    counts.push_back(*answer);
    sent += answer->sent;
    processed += answer->processed;
  }
  const bool is_quiet = answers_are_quiet_ && sent == processed && wave_ >= first_valid_wave_;
  terminated_ = is_quiet && counts == confirmed_by_;
  // A quiet wave that confirms nothing yet is the first look of the next pair.
  confirmation_is_due_ = is_quiet && !terminated_;
  if (is_quiet)
    confirmed_by_ = std::move(counts);
  else
    confirmed_by_.clear();
}

bool Termination::looks_quiet() const {
  std::uint64_t sent = 0, processed = 0;
  for (const auto& report : latest_) {
    if (!report || !report->idle) return false;
    sent += report->messages_sent;
    processed += report->messages_processed;
  }
  return sent == processed;
}

std::optional<std::uint64_t> Termination::wave_to_start() {
  if (terminated_ || wave_under_way_ || !(confirmation_is_due_ || looks_quiet())) return std::nullopt;
  confirmation_is_due_ = false;
  wave_under_way_ = true;
  answers_.assign(cells_, std::nullopt);
  answers_are_quiet_ = true;
  return ++wave_;
}

void Termination::reset() {
  // A wave under way still has to come home (its answers can not be called back), but it proves nothing any more.
  first_valid_wave_ = wave_ + 1;
  confirmed_by_.clear();
  confirmation_is_due_ = false;
  terminated_ = false;
  for (auto& report : latest_)
    if (report) report->idle = false;
}

}  // namespace lichthof
