/// The actors of a run. None outlives the company, whatever happens: an actor system waits for its last actor without limit.
#pragma once

#include <caf/all.hpp>
#include <vector>

namespace lichthof::actors {

/// Ends a local actor before it deals with anything that waits for it; a handler that is running is finished.
template <class Handle>
void kill_now(const Handle& handle) {
  const auto actor = caf::actor_cast<caf::actor>(handle);
  if (actor)
    caf::anon_send<caf::message_priority::high>(actor, caf::exit_msg{actor->address(), caf::exit_reason::kill});
}

class Company {
 public:
  explicit Company(caf::actor_system& system) : system_(system) {}
  ~Company();
  Company(const Company&) = delete;
  Company& operator=(const Company&) = delete;

  template <class Handle>
  Handle join(Handle member) {
    members_.push_back(caf::actor_cast<caf::actor>(member));
    return member;
  }
  /// Ends everybody and returns when they are gone: nobody touches their machines any more.
  void dismiss();

 private:
  caf::actor_system& system_;
  std::vector<caf::actor> members_;
};

}  // namespace lichthof::actors
