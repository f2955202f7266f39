/// The state of the lab once a second, for any number of viewers: it is asked for and written down once, and only while
/// somebody looks. A viewer that falls behind gets the latest state next and no older one.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "apps/cluster/lab_service.hpp"

namespace lichthof::apps {

class EventFeed {
 public:
  /// A viewer's place; gives it back when it goes.
  class Seat {
   public:
    explicit Seat(EventFeed& feed) : feed_(feed) {}
    ~Seat();
    Seat(const Seat&) = delete;
    /// The state after the one this seat saw last, as a server-sent event; waits for it. @returns none: the feed ends
    std::shared_ptr<const std::string> next();

   private:
    EventFeed& feed_;
    std::uint64_t seen_ = 0;
  };

  EventFeed(LabService& service, int seats, std::chrono::milliseconds period);
  ~EventFeed();
  EventFeed(const EventFeed&) = delete;

  /// @returns none: all seats are taken
  std::shared_ptr<Seat> seat();
  int taken() const;
  void stop();

 private:
  void write_down();

  LabService& service_;
  const int seats_;
  const std::chrono::milliseconds period_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int taken_ = 0;
  bool stopping_ = false;
  std::uint64_t number_ = 0;
  std::shared_ptr<const std::string> latest_;
  std::thread writer_;
};

/// {"nodes", "jobs", "actors"}: what a screen shows, with the latest of the jobs that are over.
nlohmann::json load_of(LabService& service);

/// Text of a document whatever encoding its strings have.
std::string text_of(const nlohmann::json& document);

}  // namespace lichthof::apps
