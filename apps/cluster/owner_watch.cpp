#include "apps/cluster/owner_watch.hpp"

#include <glob.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <systemd/sd-bus.h>
#include <systemd/sd-login.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

namespace lichthof::apps {

namespace {

using namespace std::chrono_literals;

constexpr auto ask_every = 5s, ask_again = 60s;  // logind; after it has not answered
constexpr std::uint64_t answer_us = 1'000'000;
constexpr const char* logind = "org.freedesktop.login1";

/// Neither ptmx nor ttyS: the one is read when programs write, the other by consoles that nobody sits at.
const std::vector<std::string> terminals{"/dev/tty[0-9]*", "/dev/pts/[0-9]*", "/dev/input/*"};

/// Processor time that programs of others have used since the machine started, those that were niced apart: they yield to
/// the owner as we do. Our own is niced but for what the kernel does for it.
double others_s() {
  std::ifstream stat("/proc/stat");
  std::string word;
  double user = 0, nice = 0, system = 0;
  if (!(stat >> word >> user >> nice >> system) || word != "cpu") return 0;
  rusage own{};
  getrusage(RUSAGE_SELF, &own);
  const double own_system_s =
      static_cast<double>(own.ru_stime.tv_sec) + 1e-6 * static_cast<double>(own.ru_stime.tv_usec);
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK)) - own_system_s;
}

/// A text that libsystemd has allocated.
std::string taken(char* text) {
  const std::string copy = text ? text : "";
  std::free(text);
  return copy;
}

}  // namespace

OwnerWatch::OwnerWatch(OwnerWatchOptions options) : options_(std::move(options)), presence_(options_.presence) {}

OwnerWatch::~OwnerWatch() { sd_bus_flush_close_unref(bus_); }

bool OwnerWatch::is_away() {
  const Clock::time_point now = Clock::now();
  OwnerSigns signs;
  signs.since_touch = since_touch();
  signs.others_cores = others_cores(now);
  signs.is_desktop_active = options_.files.empty() && is_desktop_active(now);
  return presence_.look(signs, {std::chrono::nanoseconds(now.time_since_epoch()).count()});
}

std::optional<Duration> OwnerWatch::since_touch() const {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const auto ns = [](const timespec& t) { return std::int64_t{1'000'000'000} * t.tv_sec + t.tv_nsec; };
  std::optional<Duration> least;
  for (const std::string& pattern : options_.files.empty() ? terminals : options_.files) {
    glob_t found{};
    if (::glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found) == 0)
      for (std::size_t i = 0; i < found.gl_pathc; ++i) {
        struct stat facts {};
        if (::stat(found.gl_pathv[i], &facts) != 0 || S_ISDIR(facts.st_mode)) continue;
        const Duration since{ns(now) - ns(facts.st_atim)};
        least = std::min(least.value_or(since), since);
      }
    ::globfree(&found);
  }
  return least;
}

double OwnerWatch::others_cores(Clock::time_point now) {
  const double used_s = others_s(), before_s = std::exchange(others_s_, used_s);
  const Clock::time_point before = std::exchange(looked_, now);
  if (before == Clock::time_point{} || now <= before) return 0;
  return (used_s - before_s) / std::chrono::duration<double>(now - before).count();
}

bool OwnerWatch::is_desktop_active(Clock::time_point now) {
  if (now < asked_) return desktop_active_;
  const std::optional<bool> answer = has_active_desktop();
  asked_ = now + (answer ? ask_every : ask_again);
  return desktop_active_ = answer.value_or(false);
}

/// @returns nothing where there is no logind, or no answer
std::optional<bool> OwnerWatch::has_active_desktop() {
  char** sessions = nullptr;
  if (sd_get_sessions(&sessions) < 0) return std::nullopt;
  std::vector<std::string> desktops;
  for (char** session = sessions; session && *session; ++session) {
    char *kind = nullptr, *type = nullptr;
    if (sd_session_get_class(*session, &kind) < 0) kind = nullptr;
    if (sd_session_get_type(*session, &type) < 0) type = nullptr;
    const std::string of_kind = taken(kind), of_type = taken(type);
    // Greeters may never call themselves idle; sessions on terminals are seen by their access times.
    if (of_kind == "user" && (of_type == "x11" || of_type == "wayland") && sd_session_is_active(*session) > 0)
      desktops.emplace_back(*session);
    std::free(*session);
  }
  std::free(sessions);
  if (desktops.empty()) return false;
  if (!bus_) {
    if (sd_bus_open_system(&bus_) < 0) return bus_ = nullptr, std::nullopt;
    sd_bus_set_method_call_timeout(bus_, answer_us);
  }
  for (const std::string& desktop : desktops) {
    char* path = nullptr;
    if (sd_bus_path_encode("/org/freedesktop/login1/session", desktop.c_str(), &path) < 0) return std::nullopt;
    int is_idle = 0;
    const std::string object = taken(path);
    const int asked = sd_bus_get_property_trivial(bus_, logind, object.c_str(), "org.freedesktop.login1.Session",
                                                  "IdleHint", nullptr, 'b', &is_idle);
    if (asked < 0) {
      bus_ = sd_bus_flush_close_unref(bus_);
      return std::nullopt;
    }
    if (!is_idle) return true;
  }
  return false;
}

void yield_to_everybody() {
  // Both are of a thread; those that libraries have started before are not ours to know.
  bool is_last = true;
  const sched_param none{};
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const int thread = std::stoi(task.path().filename().string());
    is_last &= ::setpriority(PRIO_PROCESS, static_cast<id_t>(thread), 19) == 0;
    is_last &= ::sched_setscheduler(thread, SCHED_IDLE, &none) == 0;
  }
  if (!is_last) spdlog::warn("this process could not be put behind all others");
}

}  // namespace lichthof::apps
