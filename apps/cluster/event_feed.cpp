#include "apps/cluster/event_feed.hpp"

namespace lichthof::apps {

std::string text_of(const nlohmann::json& document) {
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json load_of(LabService& service) {
  constexpr std::size_t most_ended = 24;  // as many as the dashboard has places
  return {{"nodes", service.nodes()}, {"jobs", service.jobs(most_ended)}, {"actors", service.actors()}};
}

EventFeed::EventFeed(LabService& service, int seats, std::chrono::milliseconds period)
    : service_(service), seats_(seats), period_(period), writer_([this] { write_down(); }) {}

EventFeed::~EventFeed() {
  stop();
  writer_.join();
}

void EventFeed::stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  changed_.notify_all();
}

int EventFeed::taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

std::shared_ptr<EventFeed::Seat> EventFeed::seat() {
  const std::lock_guard lock(mutex_);
  if (taken_ >= seats_ || stopping_) return nullptr;
  auto seat = std::make_shared<Seat>(*this);
  ++taken_;
  changed_.notify_all();
  return seat;
}

EventFeed::Seat::~Seat() {
  const std::lock_guard lock(feed_.mutex_);
  --feed_.taken_;
}

std::shared_ptr<const std::string> EventFeed::Seat::next() {
  std::unique_lock lock(feed_.mutex_);
  feed_.changed_.wait(lock, [&] { return feed_.stopping_ || feed_.number_ > seen_; });
  seen_ = feed_.number_;
  return feed_.stopping_ ? nullptr : feed_.latest_;
}

void EventFeed::write_down() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || taken_ > 0; });
    if (stopping_) return;
    lock.unlock();
    std::string event;
    try {
      event = "data: " + text_of(load_of(service_)) + "\n\n";
    } catch (const std::exception&) {
      event = ": the state of the lab could not be told\n\n";
    }
    lock.lock();
    latest_ = std::make_shared<const std::string>(std::move(event));
    ++number_;
    changed_.notify_all();
    changed_.wait_for(lock, period_, [this] { return stopping_; });
  }
}

}  // namespace lichthof::apps
