#include "apps/common/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace lichthof::apps {

namespace {

/// ", 12 s left", once an estimate is worth something.
std::string time_left(double share, double elapsed_s) {
  if (share < 0.02 || share >= 1 || elapsed_s < 0.5) return "";
  return ", " + duration_text(elapsed_s * (1 - share) / share) + " left";
}

}  // namespace

std::string duration_text(double seconds) {
  char text[48];
  const long whole = std::lround(std::clamp(seconds, 0.0, 1e9));
  if (whole < 60)
    std::snprintf(text, sizeof text, "%ld s", whole);
  else if (whole < 3600)
    std::snprintf(text, sizeof text, "%ld min %02ld s", whole / 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%ld h %02ld min", whole / 3600, whole / 60 % 60);
  return text;
}

double share_of_way(const RadiosityProgress& progress) {
  if (!(progress.threshold_w > 0) || !(progress.largest_initial_power_w > progress.threshold_w)) return 0;
  if (progress.strongest_w <= progress.threshold_w) return 1;
  const double whole = std::log(progress.largest_initial_power_w / progress.threshold_w);
  return std::clamp(std::log(progress.largest_initial_power_w / progress.strongest_w) / whole, 0.0, 1.0);
}

ProgressLine::ProgressLine(bool wanted, std::string before)
    : shown_(wanted && ::isatty(STDERR_FILENO) == 1), before_(std::move(before)), start_(std::chrono::steady_clock::now()) {}

ProgressLine::~ProgressLine() {
  if (written_) std::fputc('\n', stderr);
}

double ProgressLine::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void ProgressLine::show(const RadiosityProgress& progress) {
  if (!shown_ || progress.phase == RunPhase::gathering) return;
  const double seconds = elapsed_s(), emitted = sum_channels(progress.emitted_w);
  const double shot = emitted > 0 ? std::clamp(1 - sum_channels(progress.unshot_w) / emitted, 0.0, 1.0) : 0.0;
  char text[120];
  std::snprintf(text, sizeof text, "radiosity %5.1f %% of the energy shot, %llu shots, %.0f shots/s", 100 * shot,
                static_cast<unsigned long long>(progress.shots),
                static_cast<double>(progress.shots) / std::max(seconds, 1e-3));
  rewrite(text + time_left(share_of_way(progress), seconds));
}

void ProgressLine::show(double share_done) {
  if (!shown_) return;
  char text[64];
  std::snprintf(text, sizeof text, "rays      %5.1f %% of the picture", 100 * share_done);
  rewrite(text + time_left(share_done, elapsed_s()));
}

void ProgressLine::show(const std::string& what, double share_done) {
  if (!shown_) return;
  char text[32];
  std::snprintf(text, sizeof text, " %5.1f %%", 100 * std::clamp(share_done, 0.0, 1.0));
  rewrite(what + text + time_left(share_done, elapsed_s()));
}

void ProgressLine::rewrite(const std::string& text) {
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, "\r%s%s\033[K", before_.c_str(), text.c_str());
  std::fflush(stderr);
  written_ = true;
}

}  // namespace lichthof::apps
