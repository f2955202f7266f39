/// What an actor's work looks like from outside: counters that any thread may read while the actor runs.
#pragma once

#include <atomic>
#include <caf/all.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace lichthof::actors {

/// Time that the calling thread has had a core so far.
std::uint64_t thread_cpu_ns();

/// Of one actor. Counts grow for ever; readers take differences.
struct Meter {
  std::string name;                       ///< "cell 3"; set before the meter is shown
  std::atomic<std::uint64_t> busy_ns{0};  ///< time spent in handlers
  std::atomic<std::uint64_t> cpu_ns{0};   ///< of it, what its thread really had a core
  std::atomic<std::uint64_t> runs{0};     ///< times it was given a thread
  std::atomic<std::uint64_t> arrived{0};  ///< messages
  std::atomic<std::uint64_t> steps{0};    ///< of its machine
  std::atomic<std::uint64_t> rays{0};     ///< that its machine traced
  std::atomic<std::uint64_t> bytes{0};    ///< of light that its machine has sent, as they would be on the wire
  std::atomic<std::uint64_t> depth{0};    ///< messages waiting when it last got a thread; 0 once none was left
  std::atomic<std::int64_t> since_ns{0};  ///< it is in a handler since then (steady clock); 0: it waits

  /// Time spent in handlers up to now, with the one it is in.
  std::uint64_t busy_ns_now() const;
};

inline std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// The meters of a run. Actors add theirs; monitoring reads them. A meter stays when its actor is gone.
class Meters {
 public:
  void add(std::shared_ptr<const Meter> meter);
  std::vector<std::shared_ptr<const Meter>> all() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<const Meter>> meters_;
};

/// An actor that is metered, whatever it does: `stateful_actor<State, Metered<Interface::base>>`.
template <class Base>
class Metered : public Base {
 public:
  explicit Metered(caf::actor_config& config) : Base(config) {}

  Meter& meter() { return *meter_; }
  /// Gives the meter its name and shows it; nothing is shown without `meters`.
  void show_meter(const std::shared_ptr<Meters>& meters, const std::string& name) {
    meter_->name = name;
    if (meters) meters->add(meter_);
  }

  using Base::enqueue;
  void enqueue(caf::mailbox_element_ptr element, caf::execution_unit* unit) override {
    meter_->arrived.fetch_add(1, std::memory_order_relaxed);
    Base::enqueue(std::move(element), unit);
  }
  caf::resumable::resume_result resume(caf::execution_unit* unit, std::size_t max_throughput) override {
    const std::shared_ptr<Meter> meter = meter_;  // the actor may be gone afterwards
    meter->depth = this->mailbox().size();
    const std::int64_t start = steady_ns();
    const std::uint64_t cpu_start = thread_cpu_ns();
    meter->since_ns = start;
    const auto result = Base::resume(unit, max_throughput);
    meter->busy_ns += static_cast<std::uint64_t>(steady_ns() - start);
    meter->cpu_ns += thread_cpu_ns() - cpu_start;
    meter->since_ns = 0;
    if (result == caf::resumable::awaiting_message) meter->depth = 0;
    ++meter->runs;
    return result;
  }

 private:
  std::shared_ptr<Meter> meter_ = std::make_shared<Meter>();
};

}  // namespace lichthof::actors
