/// What the actors write into the log, and what becomes of failures inside them. Machines report events as data; here they
/// turn into lines. The log itself (where to, from which level on) is set up by the program.
#pragma once

#include <caf/all.hpp>
#include <string>
#include <vector>

#include "core/protocol/effects.hpp"

namespace lichthof::actors {

std::string text(const Address& address);
std::string text(const Event& event);
/// The reason in words: what an exception said where there was one.
std::string text(const caf::error& error);

/// One debug line per event; costs nothing when nobody listens.
void log_events(const std::vector<Event>& events);
/// A machine addressed somebody its actor has no handle for.
void log_undeliverable(const Address& to);

// Handlers that every actor gets, see report_failures.
caf::error failure_of(const std::string& who, const std::exception_ptr& exception);
void log_unexpected(const std::string& who, const caf::message_view& message);
void log_error(const std::string& who, const caf::error& error);

/// An exception ends the actor with its text as reason; whoever monitors it is told. Messages that nobody foresaw are
/// dropped. Nothing goes to standard output.
template <class Self>
void report_failures(Self* self, const std::string& who) {
  self->set_exception_handler(
      [who](caf::scheduled_actor*, std::exception_ptr& exception) { return failure_of(who, exception); });
  self->set_default_handler([who](caf::scheduled_actor*, caf::message_view& message) -> caf::result<caf::message> {
    log_unexpected(who, message);
    return caf::sec::unexpected_message;
  });
  self->set_error_handler([who](caf::scheduled_actor* actor, caf::error& error) {
    log_error(who, error);
    actor->quit(error);
  });
}

}  // namespace lichthof::actors
