#include "actors/company.hpp"

namespace lichthof::actors {

Company::~Company() { dismiss(); }

void Company::dismiss() {
  if (members_.empty()) return;
  for (const caf::actor& member : members_) kill_now(member);
  caf::scoped_actor self{system_};
  self->wait_for(members_);
  members_.clear();
}

}  // namespace lichthof::actors
