#include "apps/common/interruption.hpp"

#include <signal.h>
#include <unistd.h>

#include <string_view>
#include <thread>

#include "core/base/check.hpp"

namespace lichthof::apps {

namespace {

// The watching thread outlives main(), so what it touches does too.
std::atomic<bool> is_asked{false}, is_final{false};
std::atomic<int> deferrals{0};

void say(std::string_view line) { (void)!::write(STDERR_FILENO, line.data(), line.size()); }

[[noreturn]] void watch(sigset_t signals) {
  while (true) {
    int signal = 0;
    if (sigwait(&signals, &signal) != 0) continue;
    if (signal == SIGTERM) is_final = true;
    if (is_asked.exchange(true) || deferrals == 0) {
      say("lichthof: interrupted\n");
      ::_exit(1);
    }
    if (::isatty(STDERR_FILENO)) say("\nlichthof: stopping; once more to stop at once\n");
  }
}

}  // namespace

Interruption::Interruption() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  MUST(pthread_sigmask(SIG_BLOCK, &signals, nullptr) == 0);
  std::thread(watch, signals).detach();
}

const std::atomic<bool>& Interruption::asked() const { return is_asked; }

void Interruption::forget() {
  if (!is_final) is_asked = false;
}

Interruption::Deferral::Deferral() { ++deferrals; }
Interruption::Deferral::~Deferral() { --deferrals; }

}  // namespace lichthof::apps
